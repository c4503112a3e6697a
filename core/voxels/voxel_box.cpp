// Boxes are half open; growing stops at the border of the volume.
#include "core/voxels/voxel_box.h"

#include <algorithm>
#include <span>

namespace kvx {
namespace {

// Looks at all of a row, as processors compare many values at once.
bool Holds(std::span<const uint16_t> row, uint16_t label) {
  uint16_t found = 0;
  for (const uint16_t value : row) found |= uint16_t(value == label);
  return found != 0;
}

}  // namespace

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

VoxelBox BoxOf(const LabelMap& labels, int label) {
  VoxelBox box;
  const Eigen::Vector3i& size = labels.grid.size;
  const size_t length = size_t(size.x()), rows = size_t(size.y()) * size_t(size.z());
  for (size_t r = 0; r < rows; ++r) {
    const std::span row(labels.values.data() + r * length, length);
    if (!Holds(row, uint16_t(label))) continue;
    const auto first = std::ranges::find(row, label);
    const auto last = std::find(row.rbegin(), row.rend(), label);
    const int j = int(r % size_t(size.y())), k = int(r / size_t(size.y()));
    box.Include({int(first - row.begin()), j, k});
    box.Include({int(row.rend() - last) - 1, j, k});
  }
  return box;
}

std::map<int, VoxelBox> BoxesOf(const LabelMap& labels) {
  std::map<int, VoxelBox> boxes;
  for (size_t v = 0; v < labels.values.size(); ++v) {
    if (labels.values[v] != 0) boxes[labels.values[v]].Include(labels.grid.Ijk(v));
  }
  return boxes;
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
