// The articulated skeleton: joints, degrees of freedom, forward kinematics (paper, section 3.1).
// Centres, axes: template world (LPS mm), neutral pose. Values: radians, 0 = template; of shifts as
// joint_values.h says.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/pose.h"

namespace kvx {

struct DegreeOfFreedom {
  std::string name;                                 // "flexion", "abduction", "rotation", ...
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // unit
  double min_rad = 0, max_rad = 0;                  // seen in the scans, widened by the stated margin
};

// Joint j drives bone j; the root's joint has no parent and no degrees of freedom. A bone without degrees of
// freedom under a moving parent is a dependent bone: its motion is interpolated over the pose of `drivers`.
struct Joint {
  int child = 0;
  int parent = kNoParent;
  PointMm centre;                     // centre of rotation
  double residual_mm = 0;             // RMS distance of the centre between child's and parent's motion
  std::vector<DegreeOfFreedom> dofs;  // applied first to last from the parent outwards
  std::vector<int> drivers;           // joints whose angles this bone's residual motion depends on
};

struct Skeleton {
  std::vector<Joint> joints;  // one per bone, same index

  int DofCount() const;
  int FirstDof(int joint) const;  // position of a joint's first angle in JointAngles
  // "tibia.flexion" -> position in JointAngles; throws NotFound naming what exists.
  int DofIndex(std::string_view qualified_name, const std::vector<std::string>& bone_names) const;
  std::vector<std::string> DofNames(const std::vector<std::string>& bone_names) const;
};

// Motion of a joint's child relative to its parent: turns about the centre, first axis outermost, and shifts.
RigidTransform JointMotion(const Joint& joint, const double* angles_rad);

// scan_from_template of every bone for given angles and root motion. `residuals`, one per bone (may be
// empty), act in the child's frame after the joint: T_child = T_parent * JointMotion * Exp(residual).
PoseVector ForwardKinematics(const Skeleton& skeleton, const JointAngles& angles, const RigidTransform& root,
                             const std::vector<Twist>& residuals);

}  // namespace kvx
