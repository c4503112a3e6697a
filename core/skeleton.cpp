// Degrees of freedom and forward kinematics.
#include "core/skeleton.h"

#include <algorithm>

#include "core/errors.h"
#include "core/joint_values.h"
#include "core/text/listed.h"

namespace kvx {

int Skeleton::DofCount() const { return FirstDof(int(joints.size())); }

int Skeleton::FirstDof(int joint) const {
  int count = 0;
  for (int j = 0; j < joint; ++j) count += int(joints[j].dofs.size());
  return count;
}

std::vector<std::string> Skeleton::DofNames(const std::vector<std::string>& bone_names) const {
  std::vector<std::string> names;
  for (const Joint& joint : joints) {
    for (const DegreeOfFreedom& dof : joint.dofs) names.push_back(bone_names[joint.child] + "." + dof.name);
  }
  return names;
}

int Skeleton::DofIndex(std::string_view qualified_name, const std::vector<std::string>& bone_names) const {
  const std::vector<std::string> names = DofNames(bone_names);
  const auto found = std::ranges::find(names, qualified_name);
  if (found != names.end()) return int(found - names.begin());
  const std::string missing = "there is no degree of freedom '" + std::string(qualified_name) + "'; ";
  if (names.empty())
    throw NotFound(missing + "none of this model's joints has any: pose it by a scan or by bone transforms");
  throw NotFound(missing + "this model has: " + Listed(names));
}

RigidTransform JointMotion(const Joint& joint, const double* angles_rad) {
  RigidTransform turn;
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  for (size_t d = 0; d < joint.dofs.size(); ++d) {
    const Eigen::Vector3d& axis = joint.dofs[d].axis;
    if (IsShift(d))
      shift_mm += ShiftMm(angles_rad[d]) * axis;
    else
      turn = turn * RotationAbout(joint.centre, axis, angles_rad[d]);
  }
  turn.translation_mm += shift_mm;
  return turn;
}

PoseVector ForwardKinematics(const Skeleton& skeleton, const JointAngles& angles, const RigidTransform& root,
                             const std::vector<Twist>& residuals) {
  PoseVector pose(skeleton.joints.size());
  const double* next = angles.data();
  for (size_t j = 0; j < pose.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    pose[j] = (joint.parent == kNoParent ? root : pose[joint.parent]) * JointMotion(joint, next);
    if (!residuals.empty()) pose[j] = pose[j] * Exp(residuals[j]);
    next += joint.dofs.size();
  }
  return pose;
}

}  // namespace kvx
