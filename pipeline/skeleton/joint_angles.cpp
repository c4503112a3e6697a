// Gauss-Newton on the angles of an ordered product of rotations.
#include "pipeline/skeleton/joint_angles.h"

namespace kvx {

// With P(a) the product, P(a + da) = P(a) Exp(B da); the columns of B are the axes as the rotations after
// them leave them.
Eigen::VectorXd AnglesOf(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation) {
  constexpr int kSteps = 30;
  const int n = int(axes.size());
  Eigen::VectorXd angles(n);
  if (n == 0) return angles;
  const Eigen::Vector3d whole = RotationVector(rotation);
  for (int d = 0; d < n; ++d) angles[d] = axes[d].dot(whole);
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Quaterniond after = Eigen::Quaterniond::Identity();
    Eigen::Matrix3Xd b(3, n);
    for (int d = n - 1; d >= 0; --d) {
      b.col(d) = after.conjugate() * axes[d];
      after = Eigen::Quaterniond(Eigen::AngleAxisd(angles[d], axes[d])) * after;
    }
    const Eigen::VectorXd change =
        b.colPivHouseholderQr().solve(RotationVector(after.conjugate() * rotation));
    angles += change;
    if (change.cwiseAbs().maxCoeff() < 1e-13) break;
  }
  return angles;
}

}  // namespace kvx
