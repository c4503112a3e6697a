// The poses of a study: joint angles, imperfections of the joints, and how the subject lay in the scanner.
#pragma once
#include <map>

#include "core/rigid_transform.h"
#include "pipeline/phantom/anatomy/anatomy.h"

namespace kvx::phantom {

struct PhantomPose {
  int index = 0;
  std::string name;
  bool seen = true;  // given to the program; otherwise kept for evaluation
  std::map<std::string, std::map<std::string, double>> angles_deg;  // bone -> axis -> angle
  std::map<std::string, Twist> slop;  // what a real joint adds, about the joint centre (rad, mm)
  RigidTransform scan_from_posed;     // whole body, per scan
};

std::vector<PhantomPose> MakePoses(const Anatomy& anatomy, uint64_t seed);

// posed_from_template of every bone at `share` (0..1) of the pose's angles, without the whole-body motion.
std::vector<RigidTransform> BoneMotions(const Anatomy& anatomy, const PhantomPose& pose, double share);
// Largest rotation of a bone against its parent, degrees: decides the number of load steps.
double LargestJointAngleDeg(const PhantomPose& pose);

inline Eigen::Vector3d Move(const RigidTransform& b_from_a, const Eigen::Vector3d& x) {
  return b_from_a.rotation * x + b_from_a.translation_mm;
}

}  // namespace kvx::phantom
