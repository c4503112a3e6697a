// Poses: where every bone is (the paper's pose vector P_k), or the joint angles that put it there.
#pragma once
#include <cstdint>
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

// Why nobody should rely on where a bone is said to be in a scan.
enum class Doubt : uint8_t {
  kNone,
  kBone,  // the evidence for this bone does not decide
  // Of the scan: it shows all bones mirrored, or in another size than the template.
  kMirrored,
  kAnotherSize,
};

// How well one bone was found in one scan.
struct BoneFit {
  RigidTransform scan_from_template;
  double correlation = 0;  // of intensities over the bone and its margin, -1..1
  Doubt doubt = Doubt::kNone;
  std::string note;  // when doubtful: why, and what to do; otherwise empty, or what to be careful about
  Twist6Covariance covariance = Twist6Covariance::Zero();

  bool Doubtful() const { return doubt != Doubt::kNone; }  // joints do without it
};
using BoneFits = std::vector<BoneFit>;  // index as in BoneSet

inline PoseVector PoseOf(const BoneFits& fits) {
  PoseVector pose;
  for (const BoneFit& fit : fits) pose.push_back(fit.scan_from_template);
  return pose;
}

// What the scan as a whole is doubted for: all its bones are.
inline void DoubtAll(Doubt doubt, const std::string& note, BoneFits& fits) {
  for (BoneFit& fit : fits) fit.doubt = doubt, fit.note = note;
}

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
