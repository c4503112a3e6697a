// Directions on a spiral from pole to pole: even, and the same in every run.
#include "pipeline/segmentation/strokes/stroke_hull.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kvx {
namespace {

constexpr int kDirections = 150;  // some 16 degrees apart
const double kGoldenAngle = M_PI * (3 - std::sqrt(5.0));

std::array<Eigen::Vector3d, kDirections> MakeDirections() {
  std::array<Eigen::Vector3d, kDirections> directions;
  for (int n = 0; n < kDirections; ++n) {
    const double z = 1 - (2 * n + 1.0) / kDirections, r = std::sqrt(1 - z * z);
    directions[n] = {r * std::cos(n * kGoldenAngle), r * std::sin(n * kGoldenAngle), z};
  }
  return directions;
}

const std::array<Eigen::Vector3d, kDirections> kOut = MakeDirections();

}  // namespace

StrokeHull::StrokeHull(const std::vector<PointMm>& strokes) : extent_mm_(kDirections, -HUGE_VAL) {
  for (const PointMm& stroke : strokes) {
    for (int n = 0; n < kDirections; ++n) extent_mm_[n] = std::max(extent_mm_[n], kOut[n].dot(stroke.lps));
  }
}

double StrokeHull::BeyondMm(const PointMm& point) const {
  double beyond = -HUGE_VAL;
  for (int n = 0; n < kDirections; ++n) beyond = std::max(beyond, kOut[n].dot(point.lps) - extent_mm_[n]);
  return beyond;
}

}  // namespace kvx
