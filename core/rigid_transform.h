// Rigid motions. A value is named b_from_a and maps frame a to frame b: x_in_b = R x_in_a + t, t in mm.
#pragma once
#include <array>

#include "core/frames.h"

namespace kvx {

struct RigidTransform {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  RigidTransform Inverse() const;
  Eigen::Matrix4d Matrix() const;
  double AngleRad() const;  // of the rotation, 0..pi
};

using Twist = Eigen::Matrix<double, 6, 1>;  // (rotation vector in rad, translation part in mm)

PointMm operator*(const RigidTransform& b_from_a, const PointMm& x_in_a);
RigidTransform operator*(const RigidTransform& c_from_b, const RigidTransform& b_from_a);

// Exponential map of SE(3) and its inverse; Log takes the rotation in [0, pi].
RigidTransform Exp(const Twist& twist);
Twist Log(const RigidTransform& b_from_a);
Eigen::Matrix3d Skew(const Eigen::Vector3d& w);                      // Skew(w) x = w cross x
Eigen::Vector3d RotationVector(const Eigen::Quaterniond& rotation);  // rad, of length 0..pi

// Rotation about an axis through a centre. The axis need not be a unit vector; zero means no rotation.
RigidTransform RotationAbout(const PointMm& centre, const Eigen::Vector3d& axis, double angle_rad);

// 4x4 row-major, as in files and over HTTP. Throws InputError when the matrix is not a proper rigid motion.
RigidTransform RigidFromRowMajor(const std::array<double, 16>& matrix);
std::array<double, 16> RowMajor(const RigidTransform& b_from_a);

}  // namespace kvx
