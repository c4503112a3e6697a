// By strokes or by a threshold.
#include "pipeline/segmentation/segment_bones.h"

#include <algorithm>
#include <iterator>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/segmentation/ct/threshold_bones.h"
#include "pipeline/segmentation/ct/threshold_doubt.h"
#include "pipeline/segmentation/grow_bones.h"
#include "pipeline/segmentation/names/propose_names.h"
#include "pipeline/segmentation/refined_parts.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "pipeline/segmentation/strokes/grey_values.h"

namespace kvx {
namespace {

constexpr double kMuscleHu = 60;      // its densest, without contrast medium
constexpr double kSurelyKept = 0.85;  // of a threshold's parts at other levels
constexpr double kGapMm = 1.5;        // of a joint, thinner ones are closed by the blur of a voxel

void RequireListed(const LabelMap& strokes, const std::vector<int>& listed) {
  if (listed.empty()) return;
  for (const uint16_t label : strokes.values) {
    if (label == 0 || label == kBackgroundStroke || std::ranges::find(listed, int(label)) != listed.end())
      continue;
    throw InputError("the strokes mark label " + std::to_string(label) +
                     ", which is no bone of the list or of the region");
  }
}

std::vector<std::string> WordedInAir(const DenseInAir& in_air) {
  if (in_air.all) {
    return {
        "all that is dense in this scan lies in air: bones without flesh, or a cast that touches its bones; "
        "check the labels, and draw strokes (seeds) instead where they are wrong"};
  }
  if (in_air.dropped == 0) return {};
  return {"what is dense and lies in air, as a table or a cast does, is taken for no bone (pieces: " +
          std::to_string(in_air.dropped) + "); draw strokes (seeds) instead where a bone is missing"};
}

// Parts that are not sure are not looked at again: what their deep voxels stand for is not known.
SegmentedBones BonesByThreshold(const Volume& scan_hu, const BoneLevels& levels, const Progress& progress) {
  DenseBones dense = ThresholdBones(scan_hu, levels);
  SegmentedBones bones{std::move(dense.labels), WordedInAir(dense.in_air), true, {}, {}};
  progress.Report(SegmentBones::kName, 0.2);
  if (KeptOtherwise(scan_hu, levels.parting_hu) < kSurelyKept) {
    bones.warnings.emplace_back(
        "where bones meet in this scan is not sure (a threshold a little higher or lower, say, parts it "
        "otherwise): bones may be joined, or in pieces; "
        "check the labels, and draw strokes (seeds) instead where they are wrong");
    return bones;
  }
  bones.labels = RefinedParts(scan_hu, bones.labels, levels.parting_hu, progress.Part(0.3, 1.0));
  if (scan_hu.grid.spacing_mm.maxCoeff() > kGapMm) {
    bones.warnings.emplace_back(
        "the voxels are as thick as the gaps of joints, so bones that touch may not have come apart; check "
        "the labels, and draw strokes (seeds) where they are wrong");
  }
  return bones;
}

std::vector<BoneDoubt> SharedStrokes(const LayeredLabels& strokes) {
  std::vector<BoneDoubt> doubts;
  for (const auto& [label, voxels] : strokes.shared_voxels) {
    doubts.push_back({label,
                      "some of its strokes' voxels are an earlier segment's as well, and count for that one "
                      "alone; draw them where only this bone is"});
  }
  return doubts;
}

}  // namespace

void RequireThreshold(const Scan& scan, std::optional<double> level_hu) {
  if (scan.denied_ct || (scan.modality == "CT" && ContradictsCt(scan.volume))) {
    throw InputError(
        "the scan's file says CT, but hardly a voxel is as light as fat (-50 HU): its greys are no "
        "Hounsfield "
        "units, and no threshold holds for them; export the series again with its rescale slope and "
        "intercept, or draw strokes (seeds)");
  }
  if (!IsHounsfield(scan.volume, scan.modality)) {
    throw InputError(
        "a threshold tells bone from soft tissue in CT only, and this scan is none by its greys (Hounsfield "
        "units, with air below -500): draw strokes (seeds), or give the CT with some air around the limb and "
        "in Hounsfield units");
  }
  if (level_hu && *level_hu < kMuscleHu) {
    throw InputError(
        "at this threshold muscle counts as bone, too (60 HU and less); give 100 to 300, or auto");
  }
  if (level_hu && std::ranges::none_of(scan.volume.values, [&](float v) { return v > *level_hu; })) {
    throw InputError("nothing in the scan is as dense as the threshold; give a lower one, or auto");
  }
}

LabelMap ReadPreviousLabels(const std::filesystem::path& path, const Grid& template_grid) {
  LabelMap previous = ReadLabels(path);
  RequireNoScan(previous, "previous label map");
  if (!(previous.grid == template_grid)) {
    throw InputError("the previous label map is not on the template's grid; segment without it");
  }
  return previous;
}

SegmentedBones SegmentBones::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const Scan& scan = *inputs.scan;
  if (!inputs.strokes_path.empty()) {
    const bool go_on = !inputs.previous_path.empty();
    const LayeredLabels given = ReadLayeredLabels(inputs.strokes_path);
    const LabelMap strokes = CarriedStrokes(given.labels, scan.volume.grid, go_on);
    RequireListed(strokes, options.listed);
    LabelMap previous;
    if (go_on) previous = ReadPreviousLabels(inputs.previous_path, scan.volume.grid);
    GrownBones grown = GrowBones(scan.volume, strokes, IsHounsfield(scan.volume, scan.modality),
                                 context.progress, go_on ? &previous : nullptr);
    std::ranges::move(SharedStrokes(given), std::back_inserter(grown.doubts));
    return {std::move(grown.labels), {}, false, std::move(grown.doubts), std::move(grown.expected_dice)};
  }
  RequireThreshold(scan, options.level_hu);
  const BoneLevels levels = LevelsOf(scan.volume, options.level_hu);
  context.progress.Report(kName, 0.2);
  return BonesByThreshold(scan.volume, levels, context.progress.Part(0.2, 1.0));
}

std::vector<ProposedBone> NamesOf(const SegmentedBones& bones, Region region) {
  std::vector<ProposedBone> named =
      bones.numbered_by_size ? ProposeNames(bones.labels, region) : NamesByNumber(bones.labels, region);
  for (ProposedBone& bone : named) {
    const auto dice = bones.expected_dice.find(bone.label);
    if (dice != bones.expected_dice.end()) bone.expected_dice = dice->second;
  }
  return named;
}

std::vector<std::string> WarningsOf(const SegmentedBones& bones, const std::map<int, std::string>& names) {
  std::vector<std::string> warnings = bones.warnings;
  std::ranges::move(Worded(bones.doubts, names), std::back_inserter(warnings));
  return warnings;
}

std::vector<std::string> WarningsOf(const SegmentedBones& bones, const std::vector<ProposedBone>& named) {
  std::map<int, std::string> names;
  for (const ProposedBone& bone : named) {
    if (!bone.name.empty() && bone.confidence >= kSureName) names[bone.label] = bone.name;
  }
  return WarningsOf(bones, names);
}

}  // namespace kvx
