// A pose space of twists.
#include "pipeline/examples/bone_residuals.h"

namespace kvx {
namespace {

constexpr double kLeverMm = 30;  // from a joint: what a turn moves there counts as much as a shift

// Bones x scans.
Eigen::MatrixXi HiddenJoints(const SkeletonFit& fit, const ExampleMoments& moments) {
  Eigen::MatrixXi hidden = moments.hidden;
  for (Eigen::Index bone = 0; bone < hidden.rows(); ++bone) {
    const int parent = fit.skeleton.joints[size_t(bone)].parent;
    if (parent != kNoParent) hidden.row(bone) = hidden.row(bone).cwiseMax(moments.hidden.row(parent));
  }
  return hidden;
}

// In mm: the joint's centre, and a point beside it.
Twist MovedAt(const Joint& joint, const Twist& twist) {
  Twist out;
  out.head<3>() = kLeverMm * twist.head<3>();
  out.tail<3>() = twist.tail<3>() + twist.head<3>().cross(joint.centre.lps);
  return out;
}

ExampleMoments MomentsOf(const SkeletonFit& fit, const ExampleMoments& of_tissue) {
  const auto scans = Eigen::Index(fit.scan_residuals.size());
  ExampleMoments out{{}, HiddenJoints(fit, of_tissue)};
  for (size_t bone = 0; bone < fit.skeleton.joints.size(); ++bone) {
    Eigen::MatrixXd moved(6, scans);
    for (Eigen::Index k = 0; k < scans; ++k)
      moved.col(k) = MovedAt(fit.skeleton.joints[bone], fit.scan_residuals[size_t(k)][bone]);
    out.of_bones.emplace_back(moved.transpose() * moved / 6);
  }
  return out;
}

}  // namespace

BoneResiduals::BoneResiduals(const SkeletonFit& fit, const ExampleMoments& moments)
    : of_scans_(fit.scan_residuals) {
  const ExampleMoments of_residuals = MomentsOf(fit, moments);
  space_ = PoseSpace(fit, {}, of_residuals);
  const int scans = int(of_scans_.size());
  for (size_t bone = 0; bone < fit.skeleton.joints.size(); ++bone) {
    const Eigen::VectorXd known = of_residuals.KnownNear(bone, scans);
    if (known.isZero()) continue;  // what was found is all that there is
    for (int k = 0; k < scans; ++k) {
      if (known[k] > 0) continue;
      const Eigen::VectorXd others = space_.CoefficientsOfOthers(int(bone), k, known);
      Twist& expected = of_scans_[size_t(k)][bone] = Twist::Zero();
      for (int l = 0; l < scans; ++l) expected += others[l] * fit.scan_residuals[size_t(l)][bone];
    }
  }
}

std::vector<Twist> BoneResiduals::At(const JointAngles& angles) const {
  const Eigen::MatrixXd coefficients = space_.Coefficients(angles);
  std::vector<Twist> out(size_t(coefficients.rows()), Twist::Zero());
  for (size_t k = 0; k < of_scans_.size(); ++k) {
    for (size_t bone = 0; bone < out.size(); ++bone)
      out[bone] += coefficients(Eigen::Index(bone), Eigen::Index(k)) * of_scans_[k][bone];
  }
  return out;
}

}  // namespace kvx
