// The axes of all joints of a skeleton together: what one joint of a finger shows helps the next.
#pragma once
#include <limits>
#include <vector>

#include "core/bone.h"
#include "pipeline/skeleton/joint_plan.h"
#include "pipeline/skeleton/relative_motion.h"

namespace kvx {

// Axes as columns, as of FitAxes, and how well each is known: variance of its tilt, per direction across it
// (rad^2); infinite of axes that the scans say nothing of.
struct FittedAxes {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d variances = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  // Of a small turn of all of them together (rad^2), in the template; zero where `variances` are infinite.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// Joints whose first axes are near parallel to that of each joint, both ways.
std::vector<std::vector<ParallelJoint>> ParallelNeighbours(const BoneSet& bones,
                                                           const std::vector<JointPlan>& plans);

// Of these the ones whose axes tell of each other: three axes explain every rotation, so the first of them
// takes nothing from neighbours and says nothing.
std::vector<std::vector<ParallelJoint>> TellingNeighbours(const BoneSet& bones,
                                                          const std::vector<JointPlan>& plans);

// One frame per bone from the motions of each bone relative to its parent. Where the
// plan says that two joints turn about near parallel axes, their first axes are drawn together, each as far
// as its own scans leave it open. The root's and dependent bones' frames mean nothing.
std::vector<FittedAxes> FitAllAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                   const std::vector<std::vector<RelativeMotion>>& motions);

}  // namespace kvx
