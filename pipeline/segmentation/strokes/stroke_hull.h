// The convex hull of a bone's strokes, by its extent in many directions: the same however the
// bone lies in the world.
#pragma once
#include <vector>

#include "core/frames.h"

namespace kvx {

class StrokeHull {
 public:
  explicit StrokeHull(const std::vector<PointMm>& strokes);  // at least one
  // How far a point lies outside, at least: less than the distance from a large flat hull. Negative inside.
  double BeyondMm(const PointMm& point) const;

 private:
  std::vector<Eigen::Vector3d> out_;  // directions, about the strokes' principal axes
  std::vector<double> extent_mm_;     // along each of them
};

}  // namespace kvx
