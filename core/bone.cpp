// Look-ups in the bone tree.
#include "core/bone.h"

#include "core/errors.h"
#include "core/text/listed.h"

namespace kvx {

int BoneSet::IndexOf(std::string_view name) const {
  for (int b = 0; b < size(); ++b) {
    if (bones[b].name == name) return b;
  }
  throw NotFound("there is no bone named '" + std::string(name) + "'; the model has " +
                 Listed(bones, &Bone::name));
}

std::vector<int> BoneSet::ChildrenOf(int bone) const {
  std::vector<int> children;
  for (int b = 0; b < size(); ++b) {
    if (bones[b].parent == bone) children.push_back(b);
  }
  return children;
}

std::map<int, std::string> BoneSet::NamesByLabel() const {
  std::map<int, std::string> names;
  for (const Bone& bone : bones) names[bone.label] = bone.name;
  return names;
}

}  // namespace kvx
