// Directions on an octahedron's faces, turned into the strokes' principal axes: the set is the same whichever
// way round and in whatever order these are, so what lies turned or mirrored has the same hull.
#include "pipeline/segmentation/strokes/stroke_hull.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace kvx {
namespace {

constexpr int kParts =
    6;  // of an octahedron's edge: 146 directions; no way is more than some 12 degrees off one

// By sines, which spaces them more evenly than the octahedron's points.
std::vector<Eigen::Vector3d> MakeDirections() {
  std::vector<Eigen::Vector3d> directions;
  for (int i = -kParts; i <= kParts; ++i) {
    for (int j = -kParts + std::abs(i); j <= kParts - std::abs(i); ++j) {
      const int k = kParts - std::abs(i) - std::abs(j);
      for (const int sign : {1, -1}) {
        const Eigen::Array3d parts(i, j, sign * k);
        if (k != 0 || sign == 1)
          directions.push_back((parts * (M_PI / 2 / kParts)).sin().matrix().normalized());
      }
    }
  }
  return directions;
}

const std::vector<Eigen::Vector3d> kOut = MakeDirections();

Eigen::Matrix3d PrincipalAxes(const std::vector<PointMm>& places) {
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  for (const PointMm& place : places) mean_mm += place.lps / double(places.size());
  Eigen::Matrix3d mm2 = Eigen::Matrix3d::Zero();
  for (const PointMm& place : places) mm2 += (place.lps - mean_mm) * (place.lps - mean_mm).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(mm2).eigenvectors();
}

}  // namespace

StrokeHull::StrokeHull(const std::vector<PointMm>& strokes) : extent_mm_(kOut.size(), -HUGE_VAL) {
  const Eigen::Matrix3d axes = PrincipalAxes(strokes);
  for (const Eigen::Vector3d& out : kOut) out_.push_back(axes * out);
  for (const PointMm& stroke : strokes) {
    for (size_t n = 0; n < out_.size(); ++n) extent_mm_[n] = std::max(extent_mm_[n], out_[n].dot(stroke.lps));
  }
}

double StrokeHull::BeyondMm(const PointMm& point) const {
  double beyond = -HUGE_VAL;
  for (size_t n = 0; n < out_.size(); ++n) beyond = std::max(beyond, out_[n].dot(point.lps) - extent_mm_[n]);
  return beyond;
}

}  // namespace kvx
