#include "pipeline/segmentation/mr/noisy_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/gaussian_blur.h"
#include "core/quantile.h"
#include "pipeline/segmentation/mr/marrow_level.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

constexpr double kMuchNoise = 0.08;  // of marrow's level; the searches count no more
constexpr double kSmoothVoxels = 0.5;

// Of marrow, in parts of its level, from neighbours in the strokes.
double NoiseOf(const Volume& scan, const LabelMap& strokes, const std::map<int, double>& marrow_levels) {
  std::vector<float> changes;
  const Eigen::Vector3i size = scan.grid.size;
  const size_t strides[] = {1, size_t(size.x()), size_t(size.x()) * size_t(size.y())};
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    const int label = strokes.values[v];
    if (label == 0 || label == kBackgroundStroke) continue;
    const double level = marrow_levels.at(label);
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] + 1 == size[axis]) continue;
      const size_t next = v + strides[axis];
      if (strokes.values[next] != label) continue;
      if (std::min(scan.values[v], scan.values[next]) < kSurelyMarrow * level) continue;
      changes.push_back(float(std::abs(scan.values[next] - scan.values[v]) / level));
    }
  }
  constexpr size_t kEnough = 30;
  return changes.size() < kEnough ? 0 : TakeMedian(changes) / kMadOfPairs;
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
