#include "pipeline/segmentation/strokes/bone_doubt.h"

namespace kvx {

std::vector<std::string> Worded(const std::vector<BoneDoubt>& doubts,
                                const std::map<int, std::string>& names) {
  std::vector<std::string> out;
  for (const BoneDoubt& doubt : doubts) {
    const auto name = names.find(doubt.label);
    out.push_back("bone " + (name == names.end() ? std::to_string(doubt.label) : name->second) + ": " +
                  doubt.text);
  }
  return out;
}

}  // namespace kvx
