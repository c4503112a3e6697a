// A plane fitted by least squares to 612 bones of hands and knees, noisy ones too; what muscle nearly as dark
// as cortex takes off was fitted to 188 bones of such scans.
#include "pipeline/segmentation/strokes/expected_dice.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

size_t Voxels(const Mask& mask) { return size_t(std::ranges::count(mask.values, 1)); }

size_t Common(const FoundBone& a, const FoundBone& b) {
  const VoxelBox both{a.box.low.cwiseMax(b.box.low), a.box.high.cwiseMin(b.box.high)};
  size_t common = 0;
  ForEachVoxel(both, [&](const Eigen::Vector3i& v) {
    const Eigen::Vector3i in_a = v - a.box.low, in_b = v - b.box.low;
    common += a.mask(in_a.x(), in_a.y(), in_a.z()) && b.mask(in_b.x(), in_b.y(), in_b.z());
  });
  return common;
}

}  // namespace

double ExpectedDice(const SearchSigns& signs) {
  const double dice = 0.48 + 0.18 * signs.agreement + 0.34 * signs.stayed - 0.06 * signs.unclear -
                      0.11 * signs.marked - (signs.bare ? 0.10 : 0.0);
  constexpr double kMostDark = 0.4;
  const double mistaken = std::min(signs.dark_inside, kMostDark) * std::sqrt(signs.dark_muscle);
  return std::clamp(dice - 0.33 * mistaken, 0.0, 1.0);
}

double Dice(const FoundBone& a, const FoundBone& b) {
  const size_t voxels = Voxels(a.mask) + Voxels(b.mask);
  return voxels == 0 ? 0 : 2.0 * double(Common(a, b)) / double(voxels);
}

double Agreement(std::span<const FoundBone> answers, size_t chosen) {
  if (answers.size() < 2) return 1;
  double sum = 0;
  for (size_t n = 0; n < answers.size(); ++n) {
    if (n != chosen) sum += Dice(answers[chosen], answers[n]);
  }
  return sum / double(answers.size() - 1);
}

}  // namespace kvx
