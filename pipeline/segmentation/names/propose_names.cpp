// What decides is how bones lie to each other, so that neither the side of the body nor the pose of the limb
// matters.
#include "pipeline/segmentation/names/propose_names.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/region_presets.h"
#include "pipeline/segmentation/names/finger_chains.h"
#include "pipeline/segmentation/names/label_shapes.h"

namespace kvx {
namespace {

ProposedBone FiguresOf(const LabelShape& shape, const Grid& grid) {
  return {shape.label,
          shape.voxels,
          double(shape.voxels) * grid.spacing_mm.prod() / 1000,
          shape.centre,
          "",
          "",
          0};
}

void Name(ProposedBone& bone, const std::string& name, double confidence) {
  bone.name = name;
  bone.confidence = std::clamp(confidence, 0.0, 1.0);
}

// -1 to 1: how surely `shape` lies at the end of b rather than of a.
double LeansTo(const LabelShape& b, const LabelShape& a, const LabelShape& shape) {
  const Eigen::Vector3d way = b.centre.lps - a.centre.lps;
  const double along = (shape.centre.lps - 0.5 * (a.centre.lps + b.centre.lps)).dot(way) / way.squaredNorm();
  return std::clamp(4 * along, -1.0, 1.0);
}

// Between patella (rounded) and fibula (slender), from -1 to 1.
double Slenderness(const LabelShape& shape) {
  constexpr double kBetween = 2.0;
  return std::clamp((shape.elongation - kBetween) / 0.7, -1.0, 1.0);
}

// Which of the two largest is the tibia: the fibula lies beside it, and it is the lower one.
void NameKnee(const std::vector<LabelShape>& shapes, std::vector<ProposedBone>& bones) {
  if (shapes.size() < 2) return;
  std::vector<size_t> by_size(shapes.size());
  for (size_t s = 0; s < by_size.size(); ++s) by_size[s] = s;
  std::ranges::stable_sort(by_size, std::greater<>(), [&](size_t s) { return shapes[s].voxels; });
  size_t femur = by_size[0], tibia = by_size[1];
  const Eigen::Vector3d way = shapes[tibia].centre.lps - shapes[femur].centre.lps;
  double vote = -std::clamp(2 * way.z() / way.norm(), -1.0, 1.0), votes = 1;
  double size_doubt = 0;
  if (shapes.size() > 2) {  // a third bone of their size could be one of them
    const double third = double(shapes[by_size[2]].voxels) / double(shapes[tibia].voxels);
    size_doubt = std::clamp(2 * (third - 0.4), 0.0, 1.0);
  }
  std::vector<size_t> small(by_size.begin() + 2, by_size.end());
  std::ranges::stable_sort(small, std::greater<>(), [&](size_t s) { return shapes[s].elongation; });
  for (const size_t s : small) {
    if (Slenderness(shapes[s]) <= 0) continue;
    vote += 2 * LeansTo(shapes[tibia], shapes[femur], shapes[s]), votes += 2;
    break;
  }
  if (vote < 0) std::swap(femur, tibia);
  const double sure = std::abs(vote) / votes * (1 - size_doubt);
  Name(bones[femur], "femur", sure), Name(bones[tibia], "tibia", sure);
  if (small.size() == 2) {
    const double apart =
        std::clamp(shapes[small[0]].elongation / shapes[small[1]].elongation - 0.7, 0.0, 1.0);
    Name(bones[small[0]], "fibula", apart), Name(bones[small[1]], "patella", apart);
  } else if (small.size() == 1) {
    const double slender = Slenderness(shapes[small[0]]);
    Name(bones[small[0]], slender > 0 ? "fibula" : "patella", std::abs(slender));
  }
}

void NameHand(const LabelMap& labels, const std::vector<LabelShape>& shapes,
              std::vector<ProposedBone>& bones) {
  const FingerChains hand = FindFingerChains(shapes, EndGapsMm(labels, shapes));
  if (hand.fingers.empty()) return;
  Name(bones[hand.carpals], "carpals", hand.confidence);
  constexpr const char* kFingers[] = {"thumb", "index", "middle", "ring", "little"};
  for (size_t f = 0; f < hand.fingers.size(); ++f) {
    const auto& chain = hand.fingers[f];
    const std::vector<std::string> parts = f == 0 ? std::vector<std::string>{"mc_", "pp_", "dp_"}
                                                  : std::vector<std::string>{"mc_", "pp_", "mp_", "dp_"};
    for (size_t n = 0; n < chain.bones.size() && n < parts.size(); ++n) {
      Name(bones[chain.bones[n]], parts[n] + kFingers[f], std::min(hand.confidence, chain.confidence[n]));
    }
  }
}

// A parent that has no label is skipped.
void AddParents(Region region, std::vector<ProposedBone>& bones) {
  const auto there = [&](const std::string& name) {
    return std::ranges::any_of(bones, [&](const ProposedBone& bone) { return bone.name == name; });
  };
  for (ProposedBone& bone : bones) {
    const PresetBone* preset = FindPreset(region, bone.name);
    std::string parent = preset ? preset->parent : "";
    while (!parent.empty() && !there(parent)) parent = FindPreset(region, parent)->parent;
    bone.parent = parent;
  }
}

std::string TitleOf(const ProposedBone& bone) { return "label " + std::to_string(bone.label); }

}  // namespace

std::vector<ProposedBone> ProposeNames(const LabelMap& labels, Region region) {
  const std::vector<LabelShape> shapes = LabelShapes(labels);
  std::vector<ProposedBone> bones;
  for (const LabelShape& shape : shapes) bones.push_back(FiguresOf(shape, labels.grid));
  if (shapes.size() > RegionPreset(region).size()) return bones;
  if (region == Region::kKnee) NameKnee(shapes, bones);
  if (region == Region::kHand) NameHand(labels, shapes, bones);
  AddParents(region, bones);
  return bones;
}

bool NumberedAsPreset(const std::vector<int>& labels, Region region) {
  const int most = int(RegionPreset(region).size());
  const auto beyond = std::ranges::count_if(labels, [&](int label) { return label > most; });
  return std::ranges::find(labels, 1) != labels.end() || 2 * size_t(beyond) <= labels.size();
}

std::vector<ProposedBone> NamesByNumber(const LabelMap& labels, Region region) {
  std::vector<ProposedBone> bones = ProposeNames(labels, region);
  std::vector<int> numbers;
  for (const ProposedBone& bone : bones) numbers.push_back(bone.label);
  if (!NumberedAsPreset(numbers, region)) return bones;
  const auto& preset = RegionPreset(region);
  for (ProposedBone& bone : bones) {
    const ProposedBone proposed = bone;
    bone.name = size_t(bone.label) <= preset.size() ? preset[size_t(bone.label) - 1].name : "";
    bone.confidence = bone.name.empty() ? 0 : 1;
    if (proposed.name == bone.name || proposed.confidence < kSureName) continue;
    bone.confidence = bone.name.empty() ? 0 : 1 - proposed.confidence;
    bone.looks_like = proposed.name;
  }
  AddParents(region, bones);
  return bones;
}

std::vector<std::string> NamesInDoubt(const std::vector<ProposedBone>& bones) {
  std::vector<std::string> doubts;
  for (const ProposedBone& bone : bones) {
    if (!bone.looks_like.empty() && !bone.name.empty()) {
      doubts.push_back(TitleOf(bone) + " is " + bone.name + " by its number, but looks like " +
                       bone.looks_like + "; say in bones.list what it is");
    } else if (bone.name.empty()) {
      doubts.push_back(TitleOf(bone) + " has no name; give it one in bones.list, or leave it out");
    } else if (bone.confidence < kSureName) {
      doubts.push_back(TitleOf(bone) + " may be " + bone.name + "; say in bones.list what it is");
    }
  }
  return doubts;
}

std::vector<std::string> LooksOtherwise(const BoneSet& bones, Region region) {
  std::vector<std::string> out;
  for (const ProposedBone& proposed : ProposeNames(bones.labels, region)) {
    const auto bone = std::ranges::find(bones.bones, proposed.label, &Bone::label);
    const PresetBone* preset = bone == bones.bones.end() ? nullptr : FindPreset(region, bone->name);
    if (!preset) continue;
    if (proposed.confidence >= kSureName && proposed.name != preset->name)
      out.push_back(bone->name + " looks like " + proposed.name);
  }
  return out;
}

std::vector<StudyBone> SurelyNamed(const std::vector<ProposedBone>& bones) {
  std::vector<StudyBone> named;
  for (const ProposedBone& bone : bones) {
    if (bone.name.empty()) continue;
    if (bone.confidence < kSureName) {
      throw InputError("which bone is which cannot be told surely (" + TitleOf(bone) + " may be " +
                       bone.name + "); name the labels in bones.list");
    }
    named.push_back({bone.label, bone.name, bone.parent});
  }
  if (named.empty())
    throw InputError("the bones that were found have no names; name the labels in bones.list");
  return named;
}

}  // namespace kvx
