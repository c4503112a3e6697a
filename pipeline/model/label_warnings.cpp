// Counts voxels; nothing here changes the model.
#include "pipeline/model/label_warnings.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace kvx {
namespace {

// A map's border may stand a voxel out from the skin, where a thin finger's bone comes near it
constexpr double kMostOutside = 0.1;
constexpr size_t kMostNamed = 12;

// "3, 7, 12 and 4 more"
std::string Listed(const std::vector<std::string>& names) {
  std::string out;
  for (size_t n = 0; n < std::min(names.size(), kMostNamed); ++n) out += (n ? ", " : "") + names[n];
  if (names.size() > kMostNamed) out += " and " + std::to_string(names.size() - kMostNamed) + " more";
  return out;
}

// "femur (3)" for every bone that has such voxels.
std::vector<std::string> Counts(const VoxelsByLabel& voxels, const BoneSet& bones) {
  std::vector<std::string> out;
  for (const Bone& bone : bones.bones) {
    const auto found = voxels.find(bone.label);
    if (found != voxels.end()) out.push_back(bone.name + " (" + std::to_string(found->second.size()) + ")");
  }
  return out;
}

}  // namespace

std::vector<std::string> UnusedLabels(const LabelMap& given, const BoneSet& bones) {
  std::vector<uint8_t> unused(65536, 0);
  for (const uint16_t label : given.values) unused[label] = 1;
  unused[0] = 0;
  for (const Bone& bone : bones.bones) unused[size_t(bone.label)] = 0;
  std::vector<std::string> names;
  for (size_t label = 0; label < unused.size(); ++label) {
    if (unused[label]) names.push_back(std::to_string(label));
  }
  if (names.empty()) return {};
  return {"the label map also holds labels that the list gives no bone, so they are soft tissue here: " +
          Listed(names)};
}

std::vector<std::string> MendingWarnings(const MendedLabels& mended, const BoneSet& bones) {
  const std::vector<std::string> strays = Counts(mended.strays, bones), filled = Counts(mended.filled, bones);
  std::vector<std::string> warnings;
  if (!strays.empty()) {
    warnings.push_back(
        "the label map holds stray voxels apart from the rest of their bones, which are soft tissue here: " +
        Listed(strays));
  }
  if (!filled.empty()) {
    warnings.push_back("the label map encloses voxels without a label, which are bone here: " +
                       Listed(filled));
  }
  return warnings;
}

std::vector<std::string> LabelWarnings(const LabelMap& given, const BoneSet& bones) {
  std::vector<std::string> warnings = UnusedLabels(given, bones);
  std::ranges::move(MendingWarnings(MendLabels(given), bones), std::back_inserter(warnings));
  return warnings;
}

std::vector<std::string> BonesOutsideBody(const BoneSet& bones, const Mask& body) {
  std::vector<size_t> outside(65536, 0);
  for (size_t v = 0; v < bones.labels.values.size(); ++v) {
    if (!body.values[v]) ++outside[bones.labels.values[v]];
  }
  std::vector<std::string> names;
  for (const Bone& bone : bones.bones) {
    const double share = double(outside[size_t(bone.label)]) / double(bone.voxels);
    if (share > kMostOutside)
      names.push_back(bone.name + " (" + std::to_string(std::lround(100 * share)) + " %)");
  }
  if (names.empty()) return {};
  return {
      "these bones lie partly outside the body of the template; was the label map made on this scan, and not "
      "mirrored or moved since? " +
      Listed(names)};
}

}  // namespace kvx
