// SE(3): composition, exponential map, and the row-major 4x4 form of files.
#include "core/rigid_transform.h"

#include <cmath>

#include "core/errors.h"

namespace kvx {
namespace {

// The left Jacobian V of SO(3): the translation of Exp(w, v) is V v.
Eigen::Matrix3d LeftJacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d k = Skew(w);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() + 0.5 * k;
  const double a2 = angle * angle;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / a2 * k +
         (angle - std::sin(angle)) / (a2 * angle) * k * k;
}

}  // namespace

Eigen::Matrix3d Skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

RigidTransform RigidTransform::Inverse() const {
  const Eigen::Quaterniond inverse = rotation.conjugate();
  return {inverse, -(inverse * translation_mm)};
}

Eigen::Matrix4d RigidTransform::Matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation_mm;
  return m;
}

double RigidTransform::AngleRad() const {
  return 2.0 * std::atan2(rotation.vec().norm(), std::abs(rotation.w()));
}

PointMm operator*(const RigidTransform& b_from_a, const PointMm& x_in_a) {
  return {b_from_a.rotation * x_in_a.lps + b_from_a.translation_mm};
}

RigidTransform operator*(const RigidTransform& c_from_b, const RigidTransform& b_from_a) {
  return {(c_from_b.rotation * b_from_a.rotation).normalized(),
          c_from_b.rotation * b_from_a.translation_mm + c_from_b.translation_mm};
}

RigidTransform Exp(const Twist& twist) {
  const Eigen::Vector3d w = twist.head<3>();
  const double angle = w.norm();
  RigidTransform out;
  if (angle > 1e-12) out.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
  out.translation_mm = LeftJacobian(w) * twist.tail<3>();
  return out;
}

Twist Log(const RigidTransform& b_from_a) {
  Eigen::Quaterniond q = b_from_a.rotation.normalized();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  const double angle = 2.0 * std::atan2(sine, q.w());
  const Eigen::Vector3d w =
      sine > 1e-12 ? Eigen::Vector3d(q.vec() * (angle / sine)) : Eigen::Vector3d(2.0 * q.vec());
  Twist twist;
  twist << w, LeftJacobian(w).inverse() * b_from_a.translation_mm;
  return twist;
}

Eigen::Vector3d RotationVector(const Eigen::Quaterniond& rotation) {
  return Log({rotation, Eigen::Vector3d::Zero()}).head<3>();
}

RigidTransform RotationAbout(const PointMm& centre, const Eigen::Vector3d& axis, double angle_rad) {
  const double length = axis.norm();
  if (length < 1e-12) return {};
  const Eigen::Quaterniond q(Eigen::AngleAxisd(angle_rad, axis / length));
  return {q, centre.lps - q * centre.lps};
}

RigidTransform RigidFromRowMajor(const std::array<double, 16>& matrix) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> m(matrix.data());
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const bool last_row = m.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-6);
  if (!m.allFinite() || !last_row || !(r * r.transpose()).isIdentity(1e-3) || r.determinant() < 0) {
    throw InputError("a transform must be a 4x4 row-major rigid motion (a rotation and a translation in mm)");
  }
  return {Eigen::Quaterniond(r).normalized(), m.topRightCorner<3, 1>()};
}

std::array<double, 16> RowMajor(const RigidTransform& b_from_a) {
  std::array<double, 16> out;
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(out.data()) = b_from_a.Matrix();
  return out;
}

}  // namespace kvx
