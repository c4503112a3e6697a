// About which axes a joint turns.
#include "pipeline/skeleton/joint_fit.h"

namespace kvx {
namespace {

constexpr double kDecides = RadFromDeg(5);  // a smaller rotation is within what bones are found to

Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q) {
  return Log({q, Eigen::Vector3d::Zero()}).head<3>();
}

// Dominant direction of the rotation vectors across `first` (zero: in space), when it turns far enough.
std::optional<Eigen::Vector3d> DominantAxis(std::span<const RelativeMotion> motions,
                                            const Eigen::Vector3d& first) {
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - first * first.transpose();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const RelativeMotion& m : motions) {
    const Eigen::Vector3d r = across * RotationVector(m.motion.rotation);
    scatter += m.weight * r * r.transpose();
  }
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
  double widest = 0;
  for (const RelativeMotion& m : motions) {
    if (m.weight < 0.5) continue;
    widest = std::max(widest, std::abs(axis.dot(RotationVector(m.motion.rotation))));
  }
  if (widest < kDecides) return std::nullopt;
  return axis;
}

Eigen::Matrix3d FrameOf(const Eigen::Vector3d& first, Eigen::Vector3d second) {
  second = (second - first * first.dot(second)).normalized();
  Eigen::Matrix3d frame;
  frame << first, second, first.cross(second);
  return frame;
}

// Across the bone and the first axis; where the bone lies along that axis, across its width instead.
Eigen::Vector3d SecondFromBox(const Eigen::Vector3d& first, const OrientedBox& box) {
  const Eigen::Vector3d across = box.axes.col(0).cross(first);
  return across.norm() > 0.3 ? across.normalized() : Eigen::Vector3d(box.axes.col(1));
}

Eigen::VectorXd Unexplained(std::span<const RelativeMotion> motions, const Eigen::Matrix3d& frame,
                            int dof_count) {
  std::vector<Eigen::Vector3d> axes;
  for (int d = 0; d < dof_count; ++d) axes.push_back(frame.col(d));
  Eigen::VectorXd rest(3 * int(motions.size()));
  for (size_t k = 0; k < motions.size(); ++k) {
    const Eigen::VectorXd angles = AnglesOf(axes, motions[k].motion.rotation);
    Eigen::Quaterniond product = Eigen::Quaterniond::Identity();
    for (int d = 0; d < dof_count; ++d) product = product * Eigen::AngleAxisd(angles[d], axes[d]);
    rest.segment<3>(3 * int(k)) =
        std::sqrt(motions[k].weight) * RotationVector(product.conjugate() * motions[k].motion.rotation);
  }
  return rest;
}

Eigen::Matrix3d Turned(const Eigen::Matrix3d& frame, const Eigen::Vector3d& by) {
  const Twist twist = (Twist() << by, Eigen::Vector3d::Zero()).finished();
  return Exp(twist).rotation.toRotationMatrix() * frame;
}

// Levenberg-Marquardt over turns of the whole frame; the angles are solved anew at each (variable
// projection).
Eigen::Matrix3d Refined(std::span<const RelativeMotion> motions, Eigen::Matrix3d frame, int dof_count) {
  constexpr int kSteps = 40;
  constexpr double kDifference = 1e-6;
  double damping = 1e-3;
  Eigen::VectorXd rest = Unexplained(motions, frame, dof_count);
  for (int step = 0; step < kSteps && rest.norm() > 1e-13; ++step) {
    Eigen::MatrixX3d jacobian(rest.size(), 3);
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d by = kDifference * Eigen::Vector3d::Unit(c);
      jacobian.col(c) = (Unexplained(motions, Turned(frame, by), dof_count) -
                         Unexplained(motions, Turned(frame, -by), dof_count)) /
                        (2 * kDifference);
    }
    Eigen::Matrix3d normal = jacobian.transpose() * jacobian;
    normal += (damping * normal.trace() + 1e-12) * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d tried = Turned(frame, -normal.ldlt().solve(jacobian.transpose() * rest));
    const Eigen::VectorXd tried_rest = Unexplained(motions, tried, dof_count);
    const bool better = tried_rest.norm() < rest.norm();
    damping = better ? std::max(1e-9, damping / 10) : damping * 10;
    if (better) frame = tried, rest = tried_rest;
    if (damping > 1e6) break;
  }
  return frame;
}

}  // namespace

Eigen::Matrix3d FitAxes(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count) {
  const auto first = DominantAxis(motions, Eigen::Vector3d::Zero());
  if (!first) return FrameOf(box.axes.col(1), box.axes.col(2));
  const auto second = DominantAxis(motions, *first);
  const Eigen::Matrix3d frame = FrameOf(*first, second ? *second : SecondFromBox(*first, box));
  if (dof_count == 2 && second) return Refined(motions, frame, 2);
  if (dof_count > 2) return frame;  // three axes explain every rotation
  const Eigen::Vector3d refined = Refined(motions, frame, 1).col(0);
  return FrameOf(refined, SecondFromBox(refined, box));
}

}  // namespace kvx
