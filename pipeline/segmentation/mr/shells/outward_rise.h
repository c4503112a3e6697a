// How well a bone's surface in MR lies on the outer side of its dark cortex.
#pragma once
#include <algorithm>

#include "core/voxels/neighbours.h"
#include "core/voxels/voxel_box.h"

namespace kvx {

// How much brighter it gets on the way out, over faces of a surface, in parts of the marrow's intensity.
class SurfaceRise {
 public:
  void Add(double rise) { sum_ += std::clamp(rise, -kMost, kMost), ++faces_; }
  // How much the faces rise by more than `usual` each, together: a surface's missing parts and false ones
  // both cost.
  double Above(double usual) const { return sum_ - usual * double(faces_); }
  // -1 without a face.
  double Mean() const { return faces_ == 0 ? -1.0 : sum_ / double(faces_); }

 private:
  static constexpr double kMost = 0.3;  // a single face's say
  double sum_ = 0;
  size_t faces_ = 0;
};

// Calls visit(index of a voxel of the mask, how much brighter the scan is beyond one of its faces), for the
// faces of the mask's surface. Faces at the border of the scan do not count. The mask lies on the grid of the
// box.
template <class Visit>
void ForEachSurfaceFace(const Volume& scan, const VoxelBox& box, const Mask& mask, Visit&& visit) {
  ForEachVoxel(box, scan.grid, [&](const Eigen::Vector3i& p, size_t part, size_t whole) {
    if (!mask.values[part]) return;
    for (int side = 0; side < 6; ++side) {
      const Eigen::Vector3i next = p + StepToSide(side), out = next + box.low;
      if (!scan.grid.Contains(out)) continue;
      if (mask.grid.Contains(next) && mask(next.x(), next.y(), next.z())) continue;
      visit(part, double(scan(out.x(), out.y(), out.z())) - scan.values[whole]);
    }
  });
}

// The share of the faces of the mask's surface beyond which the scan gets hardly brighter; 0 without a face.
// `level`: intensity of the bone's marrow. The mask lies on the grid of the box.
double ShareUnclear(const Volume& scan, double level, const VoxelBox& box, const Mask& mask);

// Of the mask's whole surface, in parts of `level`. The mask lies on the grid of the box.
SurfaceRise RiseOver(const Volume& scan, double level, const VoxelBox& box, const Mask& mask);

// The mean over the faces of the mask's surface of how much brighter it is one voxel outside than just
// inside, in parts of `level`; a single face says 0.3 at most. About 0.15 to 0.25 around a hand's bones;
// near 0 where the surface lies anywhere else. -1 for an empty mask. The mask lies on the grid of the box.
double OutwardRise(const Volume& scan, double level, const VoxelBox& box, const Mask& mask);

}  // namespace kvx
