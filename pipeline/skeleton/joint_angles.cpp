// Closed forms where there are any: as unit quaternions, the product about two axes is bilinear in the
// cosines and sines of their half angles, and how near it is to a rotation is its product with that one.
#include "pipeline/skeleton/joint_angles.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr double kParallel = 1e-9, kAtRightAngles = 1e-9;

double HalfTurnAtMost(double angle_rad) { return std::remainder(angle_rad, 2 * kPi); }

double AngleAbout(const Eigen::Vector3d& axis, const Eigen::Quaterniond& rotation) {
  return HalfTurnAtMost(2 * std::atan2(rotation.vec().dot(axis), rotation.w()));
}

Eigen::Vector2d AboutTwo(const Eigen::Vector3d& first, const Eigen::Vector3d& second,
                         const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d third = first.cross(second);
  if (third.norm() < kParallel) return {AngleAbout(first, rotation), 0.0};
  const Eigen::Vector3d v = rotation.vec();
  Eigen::Matrix2d nearness;  // rows: cosine and sine of half the first angle; columns: of the second
  nearness << rotation.w(), v.dot(second),  //
      v.dot(first), v.dot(third) - rotation.w() * first.dot(second);
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(nearness, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto angle = [](const Eigen::Vector2d& half) {
    return HalfTurnAtMost(2 * std::atan2(half.y(), half.x()));
  };
  return {angle(svd.matrixU().col(0)), angle(svd.matrixV().col(0))};
}

bool AreAtRightAngles(std::span<const Eigen::Vector3d> axes) {
  return std::abs(axes[0].dot(axes[1])) < kAtRightAngles && std::abs(axes[0].dot(axes[2])) < kAtRightAngles &&
         std::abs(axes[1].dot(axes[2])) < kAtRightAngles;
}

// In the frame of the axes, turns about x, y and z; about -z where the frame is left-handed.
Eigen::Vector3d AboutThree(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation) {
  Eigen::Matrix3d frame;
  frame << axes[0], axes[1], axes[0].cross(axes[1]);
  const Eigen::Matrix3d m = frame.transpose() * rotation.toRotationMatrix() * frame;
  const double second = std::atan2(m(0, 2), std::hypot(m(1, 2), m(2, 2)));
  const double first = std::atan2(-m(1, 2), m(2, 2));
  // What is left when the first is undone: good too where the second is a right angle.
  const double c = std::cos(first), s = std::sin(first);
  const double third = std::atan2(c * m(1, 0) + s * m(2, 0), c * m(1, 1) + s * m(2, 1));
  const bool right_handed = frame.col(2).dot(axes[2]) > 0;
  return {HalfTurnAtMost(first), second, HalfTurnAtMost(right_handed ? third : -third)};
}

// Gauss-Newton. With P(a) the product, P(a + da) = P(a) Exp(B da); the columns of B are the axes as the
// rotations after them leave them.
Eigen::Vector3d AboutThreeAskew(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation) {
  constexpr int kSteps = 30;
  constexpr double kLongestStepRad = 0.5;
  Eigen::Vector3d angles;
  angles << AboutTwo(axes[0], axes[1], rotation), 0;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Quaterniond after = Eigen::Quaterniond::Identity();
    Eigen::Matrix3d b;
    for (int d = 2; d >= 0; --d) {
      b.col(d) = after.conjugate() * axes[d];
      after = Eigen::Quaterniond(Eigen::AngleAxisd(angles[d], axes[d])) * after;
    }
    const Eigen::Vector3d change =
        b.colPivHouseholderQr().solve(RotationVector(after.conjugate() * rotation));
    const double longest = change.cwiseAbs().maxCoeff();
    angles += std::min(1.0, kLongestStepRad / std::max(longest, 1e-300)) * change;
    if (longest < 1e-13) break;
  }
  return angles.unaryExpr(&HalfTurnAtMost);
}

}  // namespace

Eigen::VectorXd AnglesOf(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation) {
  switch (axes.size()) {
    case 0:
      return Eigen::VectorXd();
    case 1:
      return Eigen::VectorXd::Constant(1, AngleAbout(axes[0], rotation));
    case 2:
      return AboutTwo(axes[0], axes[1], rotation);
    default:
      return AreAtRightAngles(axes) ? AboutThree(axes, rotation) : AboutThreeAskew(axes, rotation);
  }
}

}  // namespace kvx
