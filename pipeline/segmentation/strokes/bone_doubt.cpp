#include "pipeline/segmentation/strokes/bone_doubt.h"

#include <algorithm>
#include <utility>

#include "core/listed.h"

namespace kvx {

std::vector<std::string> Worded(const std::vector<BoneDoubt>& doubts,
                                const std::map<int, std::string>& names) {
  using Saying = std::pair<std::string, std::vector<int>>;  // and the labels that it is of
  std::vector<Saying> sayings;
  for (const BoneDoubt& doubt : doubts) {
    auto said = std::ranges::find(sayings, doubt.text, &Saying::first);
    if (said == sayings.end()) said = sayings.insert(said, {doubt.text, {}});
    said->second.push_back(doubt.label);
  }
  const auto name_of = [&](int label) {
    const auto name = names.find(label);
    return name == names.end() ? std::to_string(label) : name->second;
  };
  std::vector<std::string> out;
  for (const auto& [text, labels] : sayings)
    out.push_back((labels.size() == 1 ? "bone " : "bones ") + Listed(labels, name_of) + ": " + text);
  return out;
}

}  // namespace kvx
