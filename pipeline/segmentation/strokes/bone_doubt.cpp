// Bones of which the same is doubtful share a line.
#include "pipeline/segmentation/strokes/bone_doubt.h"

#include "core/text/listed.h"
#include "core/text/sayings.h"

namespace kvx {

std::vector<std::string> Worded(const std::vector<BoneDoubt>& doubts,
                                const std::map<int, std::string>& names) {
  Sayings sayings;
  for (const BoneDoubt& doubt : doubts) {
    const auto name = names.find(doubt.label);
    sayings.Add(name == names.end() ? std::to_string(doubt.label) : name->second, doubt.text);
  }
  std::vector<std::string> out;
  for (const auto& [text, bones] : sayings.all())
    out.push_back((bones.size() == 1 ? "bone " : "bones ") + Listed(bones) + ": " + text);
  return out;
}

}  // namespace kvx
