// The skeleton: which degrees of freedom, then joint by joint, then the angles of every scan.
#include "pipeline/skeleton/fit_skeleton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/joint_values.h"
#include "pipeline/skeleton/axis_signs.h"
#include "pipeline/skeleton/joint_angles.h"
#include "pipeline/skeleton/joint_centre.h"
#include "pipeline/skeleton/joint_chain.h"
#include "pipeline/skeleton/joint_plan.h"

namespace kvx {
namespace {

// Of a tilt with a normal spread in both directions across an axis, in standard deviations of one of them: 19
// times in 20 it is less.
constexpr double kTiltBound = 2.45;
constexpr double kRightAngleRad = RadFromDeg(90);  // an axis cannot be farther off
constexpr double kDoubtfulWeight = 0.01;           // a doubtful bone decides only what no other scan shows

// Sums round by their order: the same scans in another order have the same joints.
std::vector<Artifact<BoneFits>> ByKey(std::vector<Artifact<BoneFits>> fits) {
  std::ranges::stable_sort(fits, {}, &Artifact<BoneFits>::key);
  return fits;
}

std::vector<RelativeMotion> MotionsOf(const Bone& bone, int index,
                                      const std::vector<Artifact<BoneFits>>& fits) {
  std::vector<RelativeMotion> motions;
  for (const Artifact<BoneFits>& scan : fits) {
    const BoneFit &child = (*scan)[index], &parent = (*scan)[bone.parent];
    motions.push_back(MotionOf(parent, child, child.Doubtful() || parent.Doubtful() ? kDoubtfulWeight : 1.0));
  }
  return motions;
}

// Turns first, then how far a joint with six degrees of freedom has shifted its centre along their axes.
Eigen::VectorXd ValuesOf(const Joint& joint, const RigidTransform& motion) {
  std::vector<Eigen::Vector3d> axes;
  for (int d = 0; d < TurnsAmong(joint.dofs.size()); ++d) axes.push_back(joint.dofs[size_t(d)].axis);
  Eigen::VectorXd values(Eigen::Index(joint.dofs.size()));
  values.head(Eigen::Index(axes.size())) = AnglesOf(axes, motion.rotation);
  const Eigen::Vector3d shift_mm = (motion * joint.centre).lps - joint.centre.lps;
  for (size_t d = axes.size(); d < joint.dofs.size(); ++d)
    values[Eigen::Index(d)] = ValueOfShift(joint.dofs[d].axis.dot(shift_mm));
  return values;
}

// Scans that a joint's limits and directions are read from: those in which both its bones are sure, or all
// where they are in none.
std::vector<RelativeMotion> Telling(std::span<const RelativeMotion> motions) {
  std::vector<RelativeMotion> sure;
  for (const RelativeMotion& m : motions)
    if (m.weight > kDoubtfulWeight) sure.push_back(m);
  return sure.empty() ? std::vector<RelativeMotion>(motions.begin(), motions.end()) : sure;
}

// Limits hold what the scans show, and 0.
void Limit(std::span<const RelativeMotion> motions, double margin_rad, Joint& joint) {
  for (size_t d = 0; d < joint.dofs.size(); ++d) {
    const double margin = IsShift(d) ? ValueOfShift(kLimitMarginMm) : margin_rad;
    DegreeOfFreedom& dof = joint.dofs[d];
    dof.min_rad = -margin, dof.max_rad = margin;
    for (const RelativeMotion& m : motions) {
      const double value = ValuesOf(joint, m.motion)[Eigen::Index(d)];
      dof.min_rad = std::min(dof.min_rad, value - margin);
      dof.max_rad = std::max(dof.max_rad, value + margin);
    }
  }
}

// Without limits.
Joint FitJoint(const BoneSet& bones, int index, const JointPlan& plan,
               const std::vector<RelativeMotion>& motions, const Eigen::Matrix3d& axes) {
  Joint joint{.child = index, .parent = bones.bones[index].parent};
  joint.centre = FitCentre(motions, UsualCentre(bones, index, plan.turns_about_head));
  joint.residual_mm = CentreResidualMm(motions, joint.centre);
  for (size_t d = 0; d < plan.dofs.size(); ++d)
    joint.dofs.push_back({plan.dofs[d], axes.col(int(d % kMostTurns)), 0, 0});
  return joint;
}

std::vector<double> AxesWithin(const Joint& joint, const FittedAxes& fitted) {
  std::vector<double> within_rad;
  for (size_t d = 0; d < joint.dofs.size(); ++d)
    within_rad.push_back(kTiltBound * std::sqrt(fitted.variances[Eigen::Index(d % kMostTurns)]));
  return within_rad;
}

// A bone's residual motion depends on its own joint and the one above; a dependent bone's on its driver.
std::vector<int> DriversOf(const BoneSet& bones, const Skeleton& skeleton, int index, const JointPlan& plan) {
  const Joint& joint = skeleton.joints[index];
  std::vector<int> drivers;
  if (!joint.dofs.empty()) {
    drivers.push_back(index);
    if (!skeleton.joints[joint.parent].dofs.empty()) drivers.push_back(joint.parent);
  } else if (!plan.driver.empty()) {
    for (int b = 0; b < bones.size(); ++b) {
      if (bones.bones[b].name == plan.driver) drivers.push_back(b);
    }
  }
  return drivers;
}

}  // namespace

double SkeletonFit::AxisWithinRad(int joint, size_t dof) const {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  if (axis_within_rad.empty()) return kUnknown;
  const double within_rad = axis_within_rad[size_t(joint)][dof];
  return within_rad < kRightAngleRad ? within_rad : kUnknown;
}

ScannedRange ScannedRangeOf(const DegreeOfFreedom& dof, bool shift) {
  const double margin = shift ? ValueOfShift(kLimitMarginMm) : kLimitMarginRad;
  return {dof.min_rad + margin, dof.max_rad - margin};
}

std::vector<Digest> FitSkeleton::Inputs::Keys() const {
  std::vector<Digest> keys{bones.key};
  for (const Artifact<BoneFits>& fit : fits) keys.push_back(fit.key);
  return keys;
}

SkeletonFit FitSkeleton::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const BoneSet& bones = *inputs.bones;
  const std::vector<JointPlan> plans = PlanJoints(bones, options.region, options.joints);
  const std::vector<Artifact<BoneFits>> by_key = ByKey(inputs.fits);
  std::vector<std::vector<RelativeMotion>> motions(plans.size());
  for (int b = 0; b < bones.size(); ++b) {
    if (bones.bones[b].parent != kNoParent) motions[b] = MotionsOf(bones.bones[b], b, by_key);
  }
  std::vector<std::vector<RelativeMotion>> telling;
  for (const std::vector<RelativeMotion>& of_joint : motions) telling.push_back(Telling(of_joint));
  std::vector<FittedAxes> fitted = FitAllAxes(bones, plans, motions);
  OrientAxes(bones, plans, telling, fitted);
  SkeletonFit fit;
  for (int b = 0; b < bones.size(); ++b) {
    context.progress.Report(kName, double(b) / bones.size());
    const Bone& bone = bones.bones[b];
    Joint joint{.child = b, .centre = bone.centroid};
    if (bone.parent != kNoParent) joint = FitJoint(bones, b, plans[b], motions[b], fitted[b].axes);
    Limit(telling[b], options.limit_margin_rad, joint);
    fit.axis_within_rad.push_back(AxesWithin(joint, fitted[b]));
    fit.skeleton.joints.push_back(std::move(joint));
  }
  for (int b = 0; b < bones.size(); ++b) {
    fit.skeleton.joints[b].drivers = DriversOf(bones, fit.skeleton, b, plans[b]);
  }
  for (const Artifact<BoneFits>& scan : inputs.fits) {
    PoseAnalysis analysis = AnalysePose(fit.skeleton, PoseOf(*scan));
    fit.scan_angles.push_back(std::move(analysis.angles));
    fit.scan_residuals.push_back(std::move(analysis.residuals));
    fit.scan_roots.push_back(analysis.root);
  }
  return fit;
}

PoseAnalysis AnalysePose(const Skeleton& skeleton, const PoseVector& scan_from_template) {
  PoseAnalysis out{
      JointAngles::Zero(skeleton.DofCount()), std::vector<Twist>(skeleton.joints.size(), Twist::Zero()), {}};
  int next = 0;
  for (size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    if (joint.parent == kNoParent) {
      out.root = scan_from_template[j];
      continue;
    }
    const RigidTransform motion = scan_from_template[joint.parent].Inverse() * scan_from_template[j];
    const Eigen::VectorXd angles = ValuesOf(joint, motion);
    out.angles.segment(next, angles.size()) = angles;
    out.residuals[j] = Log(JointMotion(joint, angles.data()).Inverse() * motion);
    next += int(angles.size());
  }
  return out;
}

}  // namespace kvx
