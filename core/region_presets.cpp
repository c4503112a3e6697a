// The presets of hand and knee.
#include "core/region_presets.h"

#include <map>

#include "core/errors.h"
#include "core/frames.h"
#include "core/text/lower_case.h"

namespace kvx {
namespace {

// 23 degrees of freedom: each finger 4 (base of the proximal phalanx 2, middle 1, distal 1), the thumb 5
// (saddle joint 2, proximal phalanx 2, distal 1), and 1 each for the two metacarpals that cup the palm (ring,
// little). The metacarpals of index and middle finger are rigid to the carpals.
// Phalanges turn about the round heads of the bones before them, those of one finger about near parallel
// axes. The saddle joint's first axis is roughly parallel to that of the joint beyond it, those of the
// knuckles to each other and to their row.
std::vector<PresetBone> Hand() {
  const std::string flexion = "flexion", abduction = "abduction";
  const ParallelAxis in_finger{"", RadFromDeg(5), true}, in_thumb{"", RadFromDeg(20)};
  std::vector<PresetBone> bones = {{"carpals", "", {}, ""},
                                   {"mc_thumb", "carpals", {flexion, abduction}, ""},
                                   {"pp_thumb", "mc_thumb", {flexion, abduction}, "", true, {in_thumb}},
                                   {"dp_thumb", "pp_thumb", {flexion}, "", true, {in_finger}}};
  std::vector<ParallelAxis> in_row;  // with the knuckle before; none of the first
  for (const std::string finger : {"index", "middle", "ring", "little"}) {
    const bool cups = finger == "ring" || finger == "little";
    bones.push_back(
        {"mc_" + finger, "carpals", cups ? std::vector{flexion} : std::vector<std::string>{}, ""});
    bones.push_back({"pp_" + finger, "mc_" + finger, {flexion, abduction}, "", true, in_row});
    bones.push_back({"mp_" + finger, "pp_" + finger, {flexion}, "", true, {in_finger}});
    bones.push_back({"dp_" + finger, "mp_" + finger, {flexion}, "", true, {in_finger}});
    in_row = {{.of = "pp_" + finger, .spread_rad = RadFromDeg(15), .along_rad = RadFromDeg(20)}};
  }
  return bones;
}

std::vector<PresetBone> Knee() {
  return {{"femur", "", {}, ""},
          {"tibia", "femur", {"flexion"}, ""},
          {"fibula", "tibia", {}, "tibia"},
          {"patella", "femur", {}, "tibia"}};
}

constexpr std::pair<std::string_view, Region> kRegions[] = {
    {"hand", Region::kHand}, {"knee", Region::kKnee}, {"custom", Region::kCustom}};

}  // namespace

Region RegionFromName(std::string_view name) {
  for (const auto& [known, region] : kRegions) {
    if (known == name) return region;
  }
  throw InputError("region must be hand, knee or custom");
}

std::string_view NameOf(Region region) {
  for (const auto& [name, known] : kRegions) {
    if (known == region) return name;
  }
  return "custom";
}

const std::vector<PresetBone>& RegionPreset(Region region) {
  static const std::vector<PresetBone> hand = Hand(), knee = Knee(), custom;
  switch (region) {
    case Region::kHand:
      return hand;
    case Region::kKnee:
      return knee;
    case Region::kCustom:
      break;
  }
  return custom;
}

const PresetBone* FindPreset(Region region, std::string_view name) {
  const std::string lower = LowerCase(std::string(name));
  for (const PresetBone& bone : RegionPreset(region))
    if (bone.name == lower) return &bone;
  return nullptr;
}

std::vector<StudyBone> HeldBones(Region region, const std::function<bool(const PresetBone&, int)>& held) {
  std::map<std::string, std::string>
      nearest;  // by name, the nearest bone on the way to the root that is held
  std::vector<StudyBone> bones;
  int label = 0;
  for (const PresetBone& bone : RegionPreset(region)) {
    const std::string parent = bone.parent.empty() ? "" : nearest.at(bone.parent);
    const bool there = held(bone, ++label);
    nearest[bone.name] = there ? bone.name : parent;
    if (there) bones.push_back({label, bone.name, parent});
  }
  return bones;
}

}  // namespace kvx
