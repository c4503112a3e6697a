// Validation and topological order of the bone list.
#include "pipeline/bones/bone_set/bone_tree.h"

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <set>

#include "core/errors.h"

namespace kvx {
namespace {

void CheckNamesAndLabels(const std::vector<StudyBone>& listed) {
  if (listed.empty())
    throw InputError("the study lists no bones; name each label of the label map and its parent");
  std::set<std::string> names;
  std::set<int> labels;
  for (const StudyBone& bone : listed) {
    if (bone.name.empty()) throw InputError("every bone needs a name");
    if (bone.label < 1 || bone.label > 65535) {
      throw InputError("the label of bone '" + bone.name + "' must lie between 1 and 65535");
    }
    if (!names.insert(bone.name).second) throw InputError("the bone name '" + bone.name + "' is used twice");
    if (!labels.insert(bone.label).second) {
      throw InputError("label " + std::to_string(bone.label) + " is given to two bones");
    }
  }
  std::string root;
  for (const StudyBone& bone : listed) {
    if (!bone.parent.empty() && !names.contains(bone.parent)) {
      throw InputError("the parent '" + bone.parent + "' of bone '" + bone.name + "' is not listed");
    }
    if (!bone.parent.empty()) continue;
    if (!root.empty()) {
      throw InputError("both '" + root + "' and '" + bone.name +
                       "' have no parent; exactly one bone may be the root");
    }
    root = bone.name;
  }
}

}  // namespace

std::vector<Bone> OrderedBones(const std::vector<StudyBone>& listed) {
  CheckNamesAndLabels(listed);
  std::vector<Bone> ordered;
  std::map<std::string, int> placed;
  while (ordered.size() < listed.size()) {
    const size_t before = ordered.size();
    for (const StudyBone& bone : listed) {
      if (placed.contains(bone.name) || !(bone.parent.empty() || placed.contains(bone.parent))) continue;
      Bone out;
      out.label = bone.label;
      out.name = bone.name;
      out.parent = bone.parent.empty() ? kNoParent : placed.at(bone.parent);
      placed[bone.name] = int(ordered.size());
      ordered.push_back(std::move(out));
    }
    if (ordered.size() > before) continue;
    for (const StudyBone& bone : listed) {
      if (!placed.contains(bone.name))
        throw InputError("the parents of bone '" + bone.name + "' form a cycle");
    }
  }
  return ordered;
}

std::vector<int> LargestFirst(const BoneSet& bones) {
  std::vector<int> order(size_t(bones.size()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater<>{}, [&](int b) { return bones.bones[size_t(b)].voxels; });
  return order;
}

}  // namespace kvx
