// From the values of a label map to bones.
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "core/bone.h"

namespace kvx {

constexpr int kNoBone = -1;

// The index of the bone of every label that a label map can hold; kNoBone for those of none.
inline std::vector<int> BoneOfLabel(const std::vector<Bone>& bones) {
  std::vector<int> bone_of_label(size_t(std::numeric_limits<uint16_t>::max()) + 1, kNoBone);
  for (size_t b = 0; b < bones.size(); ++b) bone_of_label[size_t(bones[b].label)] = int(b);
  return bone_of_label;
}

}  // namespace kvx
