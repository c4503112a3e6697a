// Compares and counts; nothing here changes the model.
#include "pipeline/model/warnings/study_warnings.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/numbers/quantile.h"
#include "core/region_presets.h"
#include "core/text/lower_case.h"
#include "pipeline/bones/bone_set/border_edges.h"
#include "pipeline/bones/bone_set/far_parents.h"
#include "pipeline/model/warnings/listed_names.h"
#include "pipeline/segmentation/names/propose_names.h"

namespace kvx {
namespace {

// A map's border may stand a voxel out from the skin, where a thin finger's bone comes near it
constexpr double kMostBeside = 0.1;  // of the body's voxels
constexpr double kMostOutside = 0.1;
constexpr double kSamePlace = 1e-6;  // relative, of matrices that a file may have rounded

// "femur (3)" for every bone that has such voxels, after what is said of them all.
void Tell(const std::string& what, const std::vector<std::pair<std::string, size_t>>& voxels,
          std::vector<std::string>& out) {
  std::vector<std::string> names;
  for (const auto& [name, count] : voxels) {
    if (count > 0) names.push_back(name + " (" + std::to_string(count) + ")");
  }
  if (!names.empty()) out.push_back(what + ": " + ListedInBrief(names));
}

std::vector<std::pair<std::string, size_t>> WithNames(const BoneSet& bones,
                                                      const std::vector<size_t>& voxels) {
  std::vector<std::pair<std::string, size_t>> out;
  for (size_t b = 0; b < voxels.size(); ++b) out.emplace_back(bones.bones[b].name, voxels[b]);
  return out;
}

}  // namespace

std::vector<std::string> LimitWarnings(const PaperOptions& paper) {
  if (paper.max_blocks == 0 && paper.max_seconds == 0) return {};
  std::vector<std::string> warnings = {
      "the registration was limited: blocks that were not reached are where skinning puts them"};
  if (paper.max_seconds > 0)
    warnings.emplace_back("a limit in seconds does not give the same model twice; one in blocks does");
  return warnings;
}

std::vector<std::string> SameScanWarnings(const std::vector<std::pair<std::string, Digest>>& scans) {
  std::map<Digest, std::vector<std::string>> names_of;
  for (const auto& [name, file] : scans) names_of[file].push_back("'" + name + "'");
  std::vector<std::string> warnings;
  for (const auto& [file, names] : names_of) {
    if (names.size() > 1)
      warnings.push_back("these scans are one and the same file; was it chosen twice? " +
                         ListedInBrief(names));
  }
  return warnings;
}

std::vector<std::string> ModalityWarnings(const std::vector<std::pair<std::string, bool>>& in_hounsfield) {
  std::vector<std::string> ct, others;
  for (const auto& [name, is_ct] : in_hounsfield) (is_ct ? ct : others).push_back("'" + name + "'");
  if (ct.empty() || others.empty()) return {};
  return {"some scans are CT (" + ListedInBrief(ct) + "), others are not (" + ListedInBrief(others) +
          "): bones are found across them, but soft tissue, which looks unlike in both, is placed with about "
          "three times the errors of scans of one kind; the stated errors and the confidence say so"};
}

std::vector<std::string> ScanWarnings(const std::string& called, const Scan& scan) {
  std::vector<std::string> warnings;
  if (scan.denied_ct) {
    warnings.push_back(
        called +
        ": its file says CT, but hardly a voxel is as light as fat (-50 HU), so its greys are no Hounsfield "
        "units; it is taken as an image of unknown kind. Export the series again with its rescale slope and "
        "intercept");
  }
  if (scan.evened_slices != 0) {
    warnings.push_back(
        called + ": every other slice was " + std::to_string(std::lround(100 * scan.evened_slices)) +
        " % brighter than those beside it, as where a scanner takes slices in two passes; they were evened "
        "out before anything else");
  }
  return warnings;
}

std::vector<std::string> UnreadFieldWarnings(const std::vector<std::string>& fields) {
  return Naming("nothing reads these fields of the study file; are they misspelt? ", fields);
}

std::vector<std::string> TemplatePoseWarnings(const Study& study) {
  std::vector<std::string> moved;
  const auto given = study.initial_poses.find(study.template_scan);
  if (given == study.initial_poses.end()) return {};
  for (const auto& [bone, pose] : given->second)
    if (!pose.Matrix().isApprox(RigidTransform().Matrix(), kSamePlace)) moved.push_back(bone);
  return Naming(
      "initial_poses moves bones in the template, which is not used: there a bone lies where its labels are, "
      "and a pose is scan_from_template of another scan: ",
      moved);
}

std::vector<std::string> LabelWarnings(const BoneSet& bones) {
  std::vector<std::string> warnings;
  if (!bones.mending.unused_labels.empty()) {
    std::vector<std::string> unused;
    for (const int label : bones.mending.unused_labels) unused.push_back(std::to_string(label));
    warnings.push_back(
        "the label map also holds labels that the list gives no bone, so they are soft tissue here, or bone "
        "where a bone encloses them: " +
        ListedInBrief(unused));
  }
  Tell("the label map holds stray voxels apart from the rest of their bones, which are soft tissue here",
       WithNames(bones, bones.mending.stray_voxels), warnings);
  Tell("the label map encloses voxels of no bone, which are bone here",
       WithNames(bones, bones.mending.enclosed_voxels), warnings);
  for (std::string& line : SharedVoxelWarnings(WithNames(bones, bones.mending.shared_voxels)))
    warnings.push_back(std::move(line));
  return warnings;
}

std::vector<std::string> SharedVoxelWarnings(const std::vector<std::pair<std::string, size_t>>& shared) {
  std::vector<std::string> warnings;
  Tell("masks share voxels, which are the bone's that is listed first and were taken from", shared, warnings);
  return warnings;
}

std::vector<std::string> SegmentNameWarnings(const BoneSet& bones, const std::map<int, std::string>& names,
                                             Region region) {
  std::vector<std::string> otherwise;
  for (const Bone& bone : bones.bones) {
    const auto named = names.find(bone.label);
    if (named == names.end()) continue;
    const std::string there = LowerCase(named->second);
    const bool of_a_bone =
        FindPreset(region, there) || std::ranges::count(bones.bones, there, &Bone::name) > 0;
    if (of_a_bone && there != LowerCase(bone.name))
      otherwise.push_back(bone.name + " (label " + std::to_string(bone.label) + ", there " + there + ")");
  }
  return Naming(
      "the segmentation itself calls these bones by the names of others; say in bones.list which label is "
      "which bone: ",
      otherwise);
}

std::vector<std::string> MissingBoneWarnings(const BoneSet& bones, Region region) {
  std::vector<std::string> missing;
  for (const PresetBone& usual : RegionPreset(region)) {
    const auto is_it = [&](const Bone& bone) { return FindPreset(region, bone.name) == &usual; };
    if (std::ranges::none_of(bones.bones, is_it)) missing.push_back(usual.name);
  }
  if (missing.size() == RegionPreset(region).size()) return {};  // other names
  return Naming(
      "the label map has none of these bones of the region; where the template shows them, they and the "
      "tissue around them move with other bones, and how far off that is no stated error says: ",
      missing);
}

std::vector<std::string> NameWarnings(const BoneSet& bones, Region region) {
  return Naming(
      "by how bones lie to each other some look like others of the region; check which label is which: ",
      LooksOtherwise(bones, region));
}

std::vector<std::string> ParentWarnings(const BoneSet& bones, Region region) {
  const BoneSurfaces surfaces(bones);
  const auto with_way = [&](const FarParent& of) {
    const Bone& bone = bones.bones[size_t(of.bone)];
    return bone.name + " (" + bones.bones[size_t(bone.parent)].name + " is " +
           std::to_string(std::lround(of.apart_mm)) + " mm away)";
  };
  std::vector<std::string> parted, far;
  const std::vector<FarParent> meant_to_meet = PartedJoints(bones, surfaces, region);
  for (const FarParent& of : meant_to_meet) parted.push_back(with_way(of));
  for (const FarParent& of : FarParents(bones, surfaces)) {
    if (std::ranges::find(meant_to_meet, of.bone, &FarParent::bone) == meant_to_meet.end())
      far.push_back(with_way(of));
  }
  std::vector<std::string> warnings = Naming(
      "these bones lie farther from those that they meet than any joint is wide; does one of the two lack "
      "its end, as beyond a growth plate or a fracture where no stroke lies, or is a name wrong? ",
      parted);
  std::ranges::move(
      Naming("these bones lie far from their parents, with other bones much nearer; a bone's parent is the "
             "one that it meets at a joint: ",
             far),
      std::back_inserter(warnings));
  return warnings;
}

std::vector<std::string> MisplacedLabelWarnings(const Volume& template_scan, const LabelMap& labels) {
  const std::optional<BorderEdges> edges = EdgesOfBorders(template_scan, labels);
  if (!edges) return {};
  if (edges->follow_nothing()) {
    return {
        "the borders of the label map's bones follow no edges of the template; was the map made on this "
        "scan, and not mirrored or moved since?"};
  }
  if (!edges->moved()) return {};
  const auto along = [&](int axis) { return std::to_string(edges->shift[axis]); };
  return {"the borders of the label map's bones lie about " + std::to_string(std::lround(edges->shift_mm)) +
          " mm beside the template's edges, which they would meet if the map were moved by (" + along(0) +
          ", " + along(1) + ", " + along(2) + ") voxels; was it made on this scan, and not moved since?"};
}

std::vector<std::string> NoAirWarnings(const Mask& body) {
  if (std::ranges::count(body.values, uint8_t(0)) > 0) return {};
  return {
      "no air was found in the template, so all of its grid counts as body: where there is air beside the "
      "limb, poses are wrong near the skin; use the scan as the scanner wrote it"};
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
  return Naming(
      "these bones lie partly outside the body of the template; was the label map made on this scan, and not "
      "mirrored or moved since? ",
      names);
}

std::vector<std::string> TissueBesideBody(const Volume& scan, const Mask& body) {
  std::vector<float> inside;
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (body.values[v]) inside.push_back(scan.values[v]);
  }
  if (inside.empty()) return {};
  const float middle = TakeMedian(inside);
  size_t beside = 0;
  for (size_t v = 0; v < body.values.size(); ++v) beside += !body.values[v] && scan.values[v] > middle;
  if (double(beside) <= kMostBeside * double(inside.size())) return {};
  return {
      "the template shows tissue that no bone of the label map moves (another limb?); the model leaves it "
      "out. Label its bones if it belongs to the study"};
}

}  // namespace kvx
