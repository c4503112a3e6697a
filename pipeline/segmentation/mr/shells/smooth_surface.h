// The smooth surface of a mask: points on it with their normals, and how far voxels are beyond it.
#pragma once
#include <cmath>
#include <optional>
#include <vector>

#include "core/voxels/voxel_box.h"

namespace kvx {

// Millimetres along the axes of the mask's grid from the centre of its first voxel.
struct SurfacePoint {
  Eigen::Vector3d at_mm, outwards;
  double beyond_mm = 0;  // of what the point belongs to; negative inside
  double depth_mm = 0;   // of the middle of the mask under the point
  bool chosen = true;    // one in four, spread evenly, that stands for those around it
};

// By the signed distance on twice as many samples an axis, blurred by about half a voxel.
class SmoothSurface {
 public:
  SmoothSurface() = default;
  explicit SmoothSurface(const Mask& mask);

  const std::vector<SurfacePoint>& points() const { return points_; }
  // The point under a voxel of the mask; none where the voxel is far from the surface, or there is none.
  std::optional<SurfacePoint> Under(size_t voxel) const;
  // visit(number of a point, normal weight) for points within two deviations.
  template <class Visit>
  void ForEachNear(const Eigen::Vector3d& mm, double deviation_mm, Visit&& visit) const {
    const Eigen::Vector3d at = mm.cwiseQuotient(fine_.spacing_mm).array() + 0.5;
    const Eigen::Vector3d reach = fine_.spacing_mm.cwiseInverse() * (2 * deviation_mm);
    const VoxelBox near{(at - reach).array().ceil().cast<int>().max(0),
                        ((at + reach).array().floor().cast<int>() + 1).min(fine_.size.array())};
    ForEachVoxel(near, [&](const Eigen::Vector3i& p) {
      const int32_t point = point_at_(p.x(), p.y(), p.z());
      if (point < 0) return;
      const double r2 = (points_[size_t(point)].at_mm - mm).squaredNorm() / (deviation_mm * deviation_mm);
      if (r2 <= 4) visit(size_t(point), std::exp(-0.5 * r2));
    });
  }

 private:
  std::optional<SurfacePoint> PointOf(const Eigen::Vector3i& fine, double beyond_mm) const;
  double DepthMm(const SurfacePoint& point) const;

  Grid voxels_, fine_;
  Volume beyond_mm_;         // on the fine grid, as all below
  Image<int32_t> point_at_;  // -1: none
  std::vector<SurfacePoint> points_;
};

}  // namespace kvx
