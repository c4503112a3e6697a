// Poses: where every bone is (the paper's pose vector P_k), or the joint angles that put it there.
#pragma once
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/bone.h"
#include "core/rigid_transform.h"

namespace kvx {

// scan_from_template of every bone, index as in BoneSet (eq. 1: T_j).
using PoseVector = std::vector<RigidTransform>;

// One value per degree of freedom, in the order of Skeleton::joints: radians; shifts: core/joint_values.h.
using JointAngles = Eigen::VectorXd;

// Of a small turn about a bone's centroid (rad) and a shift of it (mm), both in the template's frame.
using Twist6Covariance = Eigen::Matrix<double, 6, 6>;

// How well one bone was found in one scan.
struct BoneFit {
  RigidTransform scan_from_template;
  double correlation = 0;  // of intensities over the bone and its margin, -1..1
  bool doubtful = false;   // the evidence does not decide: joints do without it
  std::string note;        // when doubtful: why, and what to do; otherwise empty, or what to be careful about
  Twist6Covariance covariance = Twist6Covariance::Zero();
};
using BoneFits = std::vector<BoneFit>;  // index as in BoneSet

// What a user asks for. Angles are by qualified name ("tibia.flexion"), radians; missing ones are 0.
struct AnglePose {
  std::map<std::string, double> angles_rad;
};
struct BonePose {
  std::map<std::string, RigidTransform> scan_from_template;
};  // missing bones follow their parent
struct ScanPose {
  std::string scan;
};  // as that scan was registered
using PoseRequest = std::variant<AnglePose, BonePose, ScanPose>;

}  // namespace kvx
