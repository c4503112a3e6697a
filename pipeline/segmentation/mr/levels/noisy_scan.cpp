#include "pipeline/segmentation/mr/levels/noisy_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/numbers/quantile.h"
#include "core/voxels/gaussian_blur.h"
#include "pipeline/segmentation/mr/levels/marrow_level.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

constexpr double kMuchNoise = 0.09;  // of marrow's level, as NoiseOf reads it: SNR 8 is 0.09 to 0.13
constexpr double kSmoothVoxels = 0.5;

// Of marrow, in parts of its level, from three voxels in a row about those of the strokes: bones a few voxels
// thick have slopes, which are no noise, everywhere, and short lines hardly a voxel beside another. Darker
// voxels are left out, so of much noise less is read than there is: 0.08 of 0.1, 0.09 of 0.12, 0.12 of 0.2.
double NoiseOf(const Volume& scan, const LabelMap& strokes, const std::map<int, double>& marrow_levels) {
  constexpr size_t kEnough = 30;
  std::vector<float> bends;
  const Eigen::Vector3i size = scan.grid.size;
  const size_t strides[] = {1, size_t(size.x()), size_t(size.x()) * size_t(size.y())};
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    const int label = strokes.values[v];
    if (label == 0 || label == kBackgroundStroke) continue;
    const double level = marrow_levels.at(label);
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] == 0 || p[axis] + 1 == size[axis]) continue;
      const float at = scan.values[v];
      const float before = scan.values[v - strides[axis]], after = scan.values[v + strides[axis]];
      if (std::min({before, at, after}) < kSurelyMarrow * level) continue;
      bends.push_back(float(std::abs(before - 2 * at + after) / level));
    }
  }
  return bends.size() < kEnough ? 0 : TakeMedian(bends) * kSdOfMad / std::sqrt(6.0);
}

}  // namespace

OwnOrLent<Volume> CalmScan(const Volume& scan, const LabelMap& strokes,
                           const std::map<int, double>& marrow_levels) {
  if (NoiseOf(scan, strokes, marrow_levels) < kMuchNoise) return scan;
  Volume calm = scan;
  GaussianBlur(calm, Eigen::Vector3d::Constant(kSmoothVoxels));
  return calm;
}

}  // namespace kvx
