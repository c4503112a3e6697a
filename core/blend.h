// Volume blend deformation, eq. 2: v_a = (sum_j w_j T_j) v_s,
// with a guard where the blended matrix nears singular.
#pragma once
#include "core/numbers/smooth_step.h"
#include "core/pose.h"
#include "core/weight_map.h"

namespace kvx {

using AffineMap = Eigen::Matrix<double, 3, 4>;  // x -> M.leftCols(3) x + M.col(3)

// Of the linearly blended matrix. Below kSingularDeterminant a dual-quaternion blend of the same bones
// replaces the linear one, so that eq. 7 stays invertible; from kRegularDeterminant on the linear one stands
// alone, and between them one fades into the other, so that small steps of a motion move points by small
// steps (docs/conventions.md).
constexpr double kSingularDeterminant = 0.1, kRegularDeterminant = 0.35;

// 0 to 1, smooth to the first derivative: the linear blend's share.
inline double LinearShare(double determinant) {
  return SmoothStep(kSingularDeterminant, kRegularDeterminant, determinant);
}

// The blended map at one voxel.
AffineMap Blend(const VoxelWeights& weights, const PoseVector& scan_from_template);

inline Eigen::Vector3d Apply(const AffineMap& m, const Eigen::Vector3d& x) {
  return m.leftCols<3>() * x + m.col(3);
}
inline Eigen::Vector3d ApplyInverse(const AffineMap& m, const Eigen::Vector3d& x) {
  return m.leftCols<3>().inverse() * (x - m.col(3));
}

}  // namespace kvx
