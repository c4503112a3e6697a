// Boxes are half open; growing stops at the border of the volume.
#include "core/voxel_box.h"

namespace kvx {

void VoxelBox::Include(const Eigen::Vector3i& voxel) {
  const bool first = empty();
  low = first ? voxel : Eigen::Vector3i(low.cwiseMin(voxel));
  high = first ? Eigen::Vector3i(voxel.array() + 1)
               : Eigen::Vector3i(high.cwiseMax(Eigen::Vector3i(voxel.array() + 1)));
}

VoxelBox VoxelBox::Grown(const Eigen::Vector3i& by, const Grid& within) const {
  return {(low - by).cwiseMax(0), (high + by).cwiseMin(within.size)};
}

VoxelBox BoxOf(const Mask& mask) {
  VoxelBox box;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (mask.values[v]) box.Include(mask.grid.Ijk(v));
  }
  return box;
}

Grid GridOf(const VoxelBox& box, const Grid& grid) {
  Grid part = grid;
  part.size = box.size();
  part.origin = grid.ToMm(box.low.x(), box.low.y(), box.low.z());
  return part;
}

VoxelBox GrownByMm(const VoxelBox& box, double margin_mm, const Grid& within) {
  return box.Grown((margin_mm * within.spacing_mm.cwiseInverse()).array().ceil().cast<int>().matrix(),
                   within);
}

double DiagonalMm(const VoxelBox& box, const Grid& grid) {
  return box.size().cast<double>().cwiseProduct(grid.spacing_mm).norm();
}

}  // namespace kvx
