// Signed distances from the exact distance transform of a bone and of what is around it.
#include "core/voxels/distance_map.h"

#include <algorithm>

#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

Mask CropOf(const LabelMap& labels, int label, double margin_mm) {
  const Grid& grid = labels.grid;
  VoxelBox box = BoxOf(labels, label);
  const Eigen::Vector3i pad = (margin_mm / grid.spacing_mm.array()).ceil().cast<int>().matrix();
  box.low -= pad, box.high += pad;  // may leave the grid: the world goes on there
  Mask bone(GridOf(box, grid));
  for (size_t v = 0; v < bone.values.size(); ++v) {
    const Eigen::Vector3i at = bone.grid.Ijk(v) + box.low;
    bone.values[v] = grid.Contains(at) && labels(at.x(), at.y(), at.z()) == label;
  }
  return bone;
}

// Less than from one voxel to the next where slices are much thicker than pixels are wide, so that the sign
// is that of the label.
double HalfVoxelMm(const Grid& grid) {
  return std::min(0.5 * grid.MeanSpacingMm(), 0.95 * grid.spacing_mm.minCoeff());
}

}  // namespace

Volume SignedDistance(const LabelMap& labels, int label, double margin_mm) {
  const Mask bone = CropOf(labels, label, margin_mm);
  const Image<double> outside = SquaredDistanceMm(bone), inside = SquaredDistanceMm(Complement(bone));
  const double half_voxel_mm = HalfVoxelMm(bone.grid);
  Volume out(bone.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    out.values[v] = bone.values[v] ? float(half_voxel_mm - std::sqrt(inside.values[v]))
                                   : float(std::sqrt(outside.values[v]) - half_voxel_mm);
  }
  return out;
}

}  // namespace kvx
