// Look-ups in the bone tree.
#include "core/bone.h"

#include "core/errors.h"

namespace kvx {

int BoneSet::IndexOf(std::string_view name) const {
  for (int b = 0; b < size(); ++b) {
    if (bones[b].name == name) return b;
  }
  std::string all;
  for (const Bone& bone : bones) all += (all.empty() ? "" : ", ") + bone.name;
  throw NotFound("there is no bone named '" + std::string(name) + "'; the model has " + all);
}

std::vector<int> BoneSet::ChildrenOf(int bone) const {
  std::vector<int> children;
  for (int b = 0; b < size(); ++b) {
    if (bones[b].parent == bone) children.push_back(b);
  }
  return children;
}

}  // namespace kvx
