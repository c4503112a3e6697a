// Counts voxels; nothing here changes the model.
#include "pipeline/model/label_warnings.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

// A map's border may stand a voxel out from the skin, where a thin finger's bone comes near it
constexpr double kMostOutside = 0.1;
constexpr size_t kMostNamed = 12;

}  // namespace

std::vector<std::string> UnusedLabels(const LabelMap& given, const BoneSet& bones) {
  std::vector<uint8_t> unused(65536, 0);
  for (const uint16_t label : given.values) unused[label] = 1;
  unused[0] = 0;
  for (const Bone& bone : bones.bones) unused[size_t(bone.label)] = 0;
  const auto count = size_t(std::count(unused.begin(), unused.end(), 1));
  if (count == 0) return {};
  std::string names;
  size_t named = 0;
  for (size_t label = 0; label < unused.size() && named < kMostNamed; ++label) {
    if (unused[label]) names += (named++ ? ", " : "") + std::to_string(label);
  }
  if (count > named) names += " and " + std::to_string(count - named) + " more";
  return {"the label map also holds labels that the list gives no bone, so they are soft tissue here: " +
          names};
}

std::vector<std::string> BonesOutsideBody(const BoneSet& bones, const Mask& body) {
  std::vector<size_t> outside(65536, 0);
  for (size_t v = 0; v < bones.labels.values.size(); ++v) {
    if (!body.values[v]) ++outside[bones.labels.values[v]];
  }
  std::string names;
  for (const Bone& bone : bones.bones) {
    const double share = double(outside[size_t(bone.label)]) / double(bone.voxels);
    if (share <= kMostOutside) continue;
    names +=
        (names.empty() ? "" : ", ") + bone.name + " (" + std::to_string(std::lround(100 * share)) + " %)";
  }
  if (names.empty()) return {};
  return {
      "these bones lie partly outside the body of the template; was the label map made on this scan, and not "
      "mirrored or moved since? " +
      names};
}

}  // namespace kvx
