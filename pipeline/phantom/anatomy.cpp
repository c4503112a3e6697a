// Names and look-ups shared by the two anatomies.
#include "pipeline/phantom/anatomy.h"

#include <array>

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

}  // namespace kvx::phantom
