// Counts places, spread evenly over the voxels at borders. Of a lattice of places those at flat borders would
// have few shares, and no level between them.
#include "pipeline/posing/label_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "core/host/parallel.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

using Eigen::Vector3i;

constexpr size_t kPlaces = 32;  // in a voxel: the volume of small bones to half a per cent
// From place to place, in parts of a voxel's edges: no two come together, no gap stays (Roberts 2018)
constexpr std::array<double, 3> kSpread = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

// Whether a voxel and those around it are of a label, i fastest; beyond the grid its last ones go on.
using Around = std::array<float, 27>;

Around AroundVoxel(const LabelMap& labels, uint16_t label, const Vector3i& voxel) {
  Around out;
  for (int n = 0; n < 27; ++n) {
    const Vector3i beside = voxel + Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const Vector3i at = beside.cwiseMax(0).cwiseMin(labels.grid.size - Vector3i::Ones());
    out[size_t(n)] = labels(at.x(), at.y(), at.z()) == label;
  }
  return out;
}

// At a part of the voxel's edges from its low sides.
float ShareAt(const Around& around, const Eigen::Array3d& part) {
  std::array<int, 3> low;
  std::array<double, 3> f;
  for (int a = 0; a < 3; ++a)
    low[size_t(a)] = part[a] < 0.5 ? 0 : 1, f[size_t(a)] = part[a] + 0.5 - low[size_t(a)];
  double share = 0;
  for (int n = 0; n < 8; ++n) {
    const int i = n & 1, j = (n >> 1) & 1, k = n >> 2;
    share += around[size_t(9 * (low[2] + k) + 3 * (low[1] + j) + low[0] + i)] * (i ? f[0] : 1 - f[0]) *
             (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]);
  }
  return float(share);
}

float LevelOf(const LabelMap& labels, uint16_t label, const VoxelBox& box) {
  std::vector<float> shares;  // at places of voxels that are not wholly within or without
  size_t borders_within = 0;  // such voxels that have the label
  Eigen::Array3d part = Eigen::Array3d::Constant(0.5);
  ForEachVoxel(box, labels.grid, [&](const Vector3i& in_box, size_t, size_t v) {
    const Around around = AroundVoxel(labels, label, box.low + in_box);
    if (std::ranges::adjacent_find(around, std::not_equal_to()) == around.end()) return;
    borders_within += labels.values[v] == label;
    for (size_t n = 0; n < kPlaces; ++n) {
      for (int a = 0; a < 3; ++a) part[a] += kSpread[size_t(a)], part[a] -= std::floor(part[a]);
      shares.push_back(ShareAt(around, part));
    }
  });
  const auto level = shares.begin() + std::ptrdiff_t(borders_within * kPlaces);
  if (level == shares.end()) return 0.5f;  // all of the grid
  std::ranges::nth_element(shares, level, std::greater());
  return *level;
}

}  // namespace

std::vector<float> LabelLevels(const LabelMap& labels) {
  std::vector<float> levels(size_t(std::ranges::max(labels.values)) + 1, 0.5f);
  const auto of_labels = BoxesOf(labels);
  const std::vector<std::pair<int, VoxelBox>> boxes(of_labels.begin(), of_labels.end());
  ParallelFor(boxes.size(), [&](size_t n) {
    const auto& [label, box] = boxes[n];
    levels[size_t(label)] = LevelOf(labels, uint16_t(label), box.Grown(Vector3i::Ones(), labels.grid));
  });
  return levels;
}

}  // namespace kvx
