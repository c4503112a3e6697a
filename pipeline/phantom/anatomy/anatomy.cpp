// Names and look-ups shared by the two anatomies.
#include "pipeline/phantom/anatomy/anatomy.h"

#include <algorithm>
#include <array>

#include "core/numbers/smooth_step.h"

namespace kvx::phantom {

const char* NameOf(Tissue tissue) {
  constexpr std::array<const char*, kTissueCount> kNames = {
      "air",    "skin",      "subcutaneous_fat", "muscle",          "tendon", "cortical",
      "marrow", "cartilage", "vessel",           "deep_fat_septum", "capsule"};
  return kNames[size_t(tissue)];
}

const PhantomJoint* Anatomy::JointOf(int child) const {
  for (const PhantomJoint& joint : joints) {
    if (joint.child == child) return &joint;
  }
  return nullptr;
}

double Anatomy::Slip(int bone, const Eigen::Vector3d& x) const {
  constexpr double kSoftness = 0.85;  // the zone fades over the last 15 % of its size
  double slip = 0;
  for (const PhantomJoint& joint : joints) {
    if (joint.parent != bone || joint.slip_radius_mm <= 0) continue;
    const Eigen::Vector3d off = x - joint.centre, axis = joint.axes.front().direction;
    const double along = off.dot(axis), radius = (off - along * axis).norm();
    slip = std::max(slip, (1 - SmoothStep(kSoftness * joint.slip_radius_mm, joint.slip_radius_mm, radius)) *
                              (1 - SmoothStep(kSoftness * joint.slip_half_width_mm, joint.slip_half_width_mm,
                                              std::abs(along))));
  }
  return slip;
}

double Anatomy::RigidDistance(int bone, const Eigen::Vector3d& x) const {
  const double d = bones[size_t(bone)].shape.Distance(x);
  if (d <= 0 || d > 2 * cartilage_mm) return d;
  double coat = Slip(bone, x);
  const PhantomJoint* joint = JointOf(bone);
  if (joint && joint->bends) {  // the child's side: where the parent is near
    coat = std::max(coat, 1 - SmoothStep(3.5 * cartilage_mm, 5 * cartilage_mm,
                                         bones[size_t(joint->parent)].shape.Distance(x)));
  }
  return d - cartilage_mm * coat;
}

}  // namespace kvx::phantom
