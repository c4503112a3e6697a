// JSON to Study; nothing travels further as JSON.
#include "pipeline/model/files/study_file.h"

#include <algorithm>
#include <set>
#include <span>

#include "core/farthest_place.h"
#include "core/joint_values.h"
#include "core/name.h"
#include "core/region_presets.h"
#include "core/text/json_object.h"
#include "core/text/listed.h"
#include "pipeline/io/mask_folder.h"
#include "pipeline/model/files/json_field.h"
#include "pipeline/model/files/text_file.h"

namespace kvx {
namespace {

std::filesystem::path ExistingPath(const JsonField& field, const std::filesystem::path& base,
                                   bool folder_too) {
  const std::filesystem::path path = (base / field.Text()).lexically_normal();
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) return path;
  if (folder_too && std::filesystem::is_directory(path, ignored)) return path;
  field.Fail("names a file that does not exist; paths are relative to the study file");
}

void RequireNew(std::set<std::string>& seen, const std::string& name, const JsonField& field) {
  if (!seen.insert(name).second) field.Fail("is used twice; every name must be its own");
}

std::vector<StudyScan> ParseScans(const JsonField& list, const std::filesystem::path& base) {
  std::vector<StudyScan> scans;
  std::set<std::string> seen;
  for (const JsonField& item : list.Items()) {
    const JsonField name = item.At("name");
    RequireNew(seen, name.Name(), name);
    scans.push_back({name.Name(), ExistingPath(item.At("volume"), base, true)});
  }
  if (scans.empty()) list.Fail("is empty; a study needs the template and at least one more scan");
  return scans;
}

int ParseLabel(const JsonField& label) {
  if (!label.value().is_number_integer() || label.Number() < 1 || label.Number() > 65535) {
    label.Fail("must be a whole number from 1 to 65535");
  }
  return label.value().get<int>();
}

// Of bones in a folder of masks the names say enough: without labels they are numbered in their order.
StudyBone ParseBone(const JsonField& item, size_t index, const std::filesystem::path& masks) {
  const bool by_order = !masks.empty() && !item.Has("label");
  const int label = by_order ? int(index + 1) : ParseLabel(item.At("label"));
  const JsonField name = item.At("name");
  if (!masks.empty() && MaskOf(masks, name.Name()).empty())
    name.Fail("has no mask in the folder of bones.labels; the file is named after the bone: " + name.Name() +
              ".nii.gz");
  return {label, name.Name(), item.Has("parent") ? item.At("parent").Name() : ""};
}

// One root, and every bone's line of parents ends there.
void RequireTree(const JsonField& list, const std::vector<StudyBone>& bones) {
  std::map<std::string, std::string> parent_of;
  for (const StudyBone& bone : bones) parent_of[bone.name] = bone.parent;
  const auto roots =
      std::count_if(bones.begin(), bones.end(), [](const StudyBone& bone) { return bone.parent.empty(); });
  if (roots != 1)
    list.Fail("must have exactly one root (a bone without parent); it has " + std::to_string(roots));
  for (size_t b = 0; b < bones.size(); ++b) {
    const std::string where = "[" + std::to_string(b) + "].parent";
    std::string at = bones[b].name;
    for (size_t steps = 0; !at.empty(); ++steps) {
      if (steps > bones.size())
        throw InputError(list.name() + where + " leads in a circle; parents must end at the root");
      const auto found = parent_of.find(at);
      if (found == parent_of.end())
        throw InputError(list.name() + where + " names a bone that is not in the list");
      at = found->second;
    }
  }
}

// `masks`: the folder of the bones' masks; empty where they are in one label map.
std::vector<StudyBone> ParseBones(const JsonField& list, const std::filesystem::path& masks) {
  std::vector<StudyBone> bones;
  std::set<std::string> names;
  std::set<int> labels;
  for (const JsonField& item : list.Items()) {
    bones.push_back(ParseBone(item, bones.size(), masks));
    RequireNew(names, bones.back().name, item.At("name"));
    if (!labels.insert(bones.back().label).second)
      throw InputError(item.name() + ".label is used twice; every bone has its own label");
  }
  if (bones.empty()) list.Fail("is empty; list the bones, or leave it out to use the region's preset");
  RequireTree(list, bones);
  return bones;
}

// The preset's bones whose masks are there.
std::vector<StudyBone> BonesOfMasks(Region region, const std::filesystem::path& masks) {
  const std::vector<StudyBone> bones =
      HeldBones(region, [&](const PresetBone& bone, int) { return !MaskOf(masks, bone.name).empty(); });
  const auto roots = std::ranges::count(bones, std::string(), &StudyBone::parent);
  if (roots != 1)
    throw InputError(
        "bones.labels is a folder without a mask of the region's root, " + RegionPreset(region).front().name +
        "; masks are named after their bones (femur.nii.gz), or list bones of other names in bones.list");
  return bones;
}

// By name: those of the list, else of the region's preset.
std::vector<StudyBone> BonesToFind(const JsonField& bones, Region region) {
  if (!bones.Has("list")) return HeldBones(region, [](const PresetBone&, int) { return true; });
  std::vector<StudyBone> named;
  for (const JsonField& item : bones.At("list").Items()) named.push_back({0, item.At("name").Name(), ""});
  return named;
}

// The folder of the bones' masks; empty where they are in one label map.
std::filesystem::path MasksOf(const Study& study, const JsonField& bones) {
  if (!is_directory(study.bone_labels)) return {};
  return HoldsMasks(study.bone_labels, BonesToFind(bones, study.region)) ? study.bone_labels
                                                                         : std::filesystem::path();
}

// A level in HU, or "auto".
std::optional<double> ParseThreshold(const JsonField& threshold) {
  if (threshold.value().is_string() && threshold.Text() == "auto") return std::nullopt;
  if (!threshold.value().is_number()) threshold.Fail("must be a level in HU, or \"auto\"");
  return threshold.Number();
}

constexpr const char* kBoneSources =
    "; give a label map of the template's bones in bones.labels, or strokes in bones.seeds, or "
    "bones.threshold";

void ParseBoneSource(const JsonField& bones, const std::filesystem::path& base, Study& study) {
  const int given = bones.Has("labels") + bones.Has("seeds") + bones.Has("threshold");
  if (given == 0) throw InputError(std::string("bones.labels is missing") + kBoneSources);
  if (given > 1) throw InputError("bones must hold exactly one of labels, seeds and threshold");
  if (bones.Has("labels")) study.bone_labels = ExistingPath(bones.At("labels"), base, true);
  if (bones.Has("seeds")) study.bone_seeds = ExistingPath(bones.At("seeds"), base, false);
  study.bones_by_threshold = bones.Has("threshold");
  if (study.bones_by_threshold) study.bone_level_hu = ParseThreshold(bones.At("threshold"));
}

// Of the list, else of the region's preset.
StudyBone RequireBone(const Study& study, const std::string& name, const JsonField& field) {
  const bool listed = !study.bones.empty();
  const std::vector<StudyBone> bones =
      listed ? study.bones : HeldBones(study.region, [](const PresetBone&, int) { return true; });
  const auto found = std::ranges::find(bones, name, &StudyBone::name);
  if (found == bones.end())
    field.Fail("names a bone that is not in " +
               (listed ? "bones.list" : "the region's preset (" + Listed(bones, &StudyBone::name) + ")"));
  return *found;
}

void RequireScan(const Study& study, const std::string& name, const JsonField& field) {
  const auto same = [&](const StudyScan& scan) { return scan.name == name; };
  if (std::none_of(study.scans.begin(), study.scans.end(), same))
    field.Fail("names a scan that is not in scans");
}

// A list of names, or how many: up to three turns, or six with the shifts along their axes.
std::vector<std::string> ParseDofs(const JsonField& field) {
  const std::vector<std::string> usual = {"flexion",       "abduction",       "rotation",
                                          "flexion_shift", "abduction_shift", "rotation_shift"};
  std::vector<std::string> dofs;
  if (field.value().is_number()) {
    for (const std::string& name : usual) {
      if (double(dofs.size()) < field.Number()) dofs.push_back(name);
    }
    if (double(dofs.size()) != field.Number())
      field.Fail("is not a number of degrees of freedom: 0 to 3, or 6");
  } else {
    std::set<std::string> names;
    for (const JsonField& dof : field.Items()) {
      RequireNew(names, dof.Name(), dof);
      dofs.push_back(dof.Name());
    }
  }
  if (dofs.size() > kMostTurns && dofs.size() != kTurnsAndShifts)
    field.Fail(
        "needs up to 3 degrees of freedom, all turns, or 6: three turns and the shifts along their axes");
  return dofs;
}

std::vector<StudyJoint> ParseJoints(const JsonField& list, const Study& study) {
  std::vector<StudyJoint> joints;
  std::set<std::string> children;
  for (const JsonField& item : list.Items()) {
    const JsonField child = item.At("child");
    joints.push_back({child.Name(), {}});
    RequireNew(children, child.Name(), child);
    if (RequireBone(study, child.Name(), child).parent.empty())
      child.Fail("names the root bone, which has no joint; name the bone on the other side of the joint");
    joints.back().dofs = ParseDofs(item.At("dofs"));
  }
  return joints;
}

std::map<std::string, std::map<std::string, RigidTransform>> ParseInitialPoses(const JsonField& scans,
                                                                               const Study& study) {
  std::map<std::string, std::map<std::string, RigidTransform>> poses;
  for (const auto& [scan, bones] : scans.Members()) {
    RequireScan(study, scan, bones);
    for (const auto& [bone, matrix] : bones.Members()) {
      RequireBone(study, bone, matrix);
      poses[scan][bone] = matrix.Rigid();
      if (LiesTooFar({poses[scan][bone].translation_mm}))
        matrix.Fail("moves the bone by more than a kilometre; it is in mm");
    }
  }
  return poses;
}

constexpr std::string_view kFields[] = {"name",  "region", "template",     "scans",
                                        "bones", "joints", "initial_poses"};
constexpr std::string_view kScanFields[] = {"name", "volume"};
constexpr std::string_view kBonesFields[] = {"labels", "list", "seeds", "threshold"};
// Also what `segment`, `info` and the service tell of a bone: a list may be a copy of theirs.
constexpr std::string_view kBoneFields[] = {"label",      "name", "parent",       "confidence",
                                            "looks_like", "cm3",  "centre",       "voxels",
                                            "centroid",   "obb",  "expected_dice"};
constexpr std::string_view kJointFields[] = {"child", "dofs"};

using FieldNames = std::span<const std::string_view>;

void NoteUnread(const JsonField& object, FieldNames known, std::vector<std::string>& unread) {
  for (const auto& item : object.value().items()) {
    if (std::ranges::find(known, item.key()) == known.end() && IsName(item.key()))
      unread.push_back((object.name().empty() ? "" : object.name() + ".") + item.key());
  }
}

// Of each item of a list.
void NoteUnread(const JsonField& object, const char* list, FieldNames known,
                std::vector<std::string>& unread) {
  if (!object.Has(list)) return;
  for (const JsonField& item : object.At(list).Items()) NoteUnread(item, known, unread);
}

std::vector<std::string> UnreadFields(const JsonField& root, const JsonField& bones) {
  std::vector<std::string> unread;
  NoteUnread(root, kFields, unread);
  NoteUnread(root, "scans", kScanFields, unread);
  NoteUnread(bones, kBonesFields, unread);
  NoteUnread(bones, "list", kBoneFields, unread);
  NoteUnread(root, "joints", kJointFields, unread);
  return unread;
}

}  // namespace

Study ParseStudy(std::string_view json, const std::filesystem::path& base) {
  const nlohmann::json document = ParseObject<nlohmann::json>(json, "the study file");
  const JsonField root(document, "");
  Study study;
  study.name = root.At("name").Title();
  study.region = RegionFromName(root.At("region").Text());
  study.scans = ParseScans(root.At("scans"), std::filesystem::absolute(base));
  const JsonField template_scan = root.At("template");
  study.template_scan = template_scan.Name();
  RequireScan(study, study.template_scan, template_scan);
  if (!root.Has("bones")) throw InputError(std::string("bones is missing") + kBoneSources);
  const JsonField bones = root.At("bones");
  ParseBoneSource(bones, std::filesystem::absolute(base), study);
  const std::filesystem::path masks = MasksOf(study, bones);
  if (bones.Has("list")) study.bones = ParseBones(bones.At("list"), masks);
  if (study.bones.empty() && study.region == Region::kCustom) {
    throw InputError("bones.list is missing; only the regions hand and knee have a preset");
  }
  if (study.bones.empty() && !masks.empty()) study.bones = BonesOfMasks(study.region, masks);
  if (root.Has("joints")) study.joints = ParseJoints(root.At("joints"), study);
  if (root.Has("initial_poses")) study.initial_poses = ParseInitialPoses(root.At("initial_poses"), study);
  study.unread_fields = UnreadFields(root, bones);
  return study;
}

Study ReadStudy(const std::filesystem::path& file) {
  return ParseStudy(FileText(file, "the study file"), std::filesystem::absolute(file).parent_path());
}

}  // namespace kvx
