// Green's function of the clamped plate and the eight-point basis built from it.
#include "core/clamped_plate_spline.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

// q(x, y): the distance of y from the mirror image of x, times |x|.
// At least 1 - |x||y|, so positive inside the ball.
double ImageDistance(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  return std::sqrt(std::max(0.0, x.squaredNorm() * y.squaredNorm() - 2.0 * x.dot(y) + 1.0));
}

bool Outside(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  return x.squaredNorm() >= 1.0 || y.squaredNorm() >= 1.0;
}

}  // namespace

double ClampedPlateGreen(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  if (Outside(x, y)) return 0.0;
  const double q = ImageDistance(x, y), gap = q - (x - y).norm();
  return gap * gap / q;
}

BlockSpline::BlockSpline(double inset) {
  const double c = (0.5 - inset) / 1.5;
  for (int a = 0; a < kControlPoints; ++a) points_[a] = {a & 1 ? c : -c, a & 2 ? c : -c, a & 4 ? c : -c};
  ControlMatrix green;
  for (int a = 0; a < kControlPoints; ++a) {
    for (int b = 0; b < kControlPoints; ++b) green(a, b) = ClampedPlateGreen(points_[a], points_[b]);
  }
  inverse_ = green.inverse();
}

ControlRow BlockSpline::Basis(const Eigen::Vector3d& p) const {
  ControlRow green;
  for (int a = 0; a < kControlPoints; ++a) green[a] = ClampedPlateGreen(p, points_[a]);
  return green * inverse_;
}

// The laplacian squared of |x| is -8 pi delta, so that of G is 16 pi delta; integrating by parts twice (value
// and slope vanish on the sphere) leaves 16 pi w^T G w with w = G^-1 F.
ControlMatrix BlockSpline::BendingEnergy() const { return 16.0 * kPi * inverse_; }

double BlockSpline::SelfEnergy() const { return 1.0 - points_[0].squaredNorm(); }

}  // namespace kvx
