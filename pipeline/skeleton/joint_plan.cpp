// Study, preset, or three axes.
#include "pipeline/skeleton/joint_plan.h"

#include <algorithm>

#include "core/errors.h"
#include "core/joint_values.h"
#include "core/lower_case.h"
#include "pipeline/bones/region_presets.h"

namespace kvx {
namespace {

const std::vector<std::string> kAllTurns{"flexion", "abduction", "rotation"};  // where nothing is known

const PresetBone* PresetOf(Region region, const std::string& bone) {
  for (const PresetBone& preset : RegionPreset(region))
    if (preset.name == LowerCase(bone)) return &preset;
  return nullptr;
}

// A tree that hangs on another bone than the preset's has some of its joints the other way round.
bool IsTurnedRound(const PresetBone* child, const PresetBone* parent) {
  return child && parent && parent->parent == child->name;
}

// The bone whose joint is that between `driver` and its parent in the preset.
std::string NameOfDriver(const BoneSet& bones, Region region, const std::string& driver) {
  for (const Bone& bone : bones.bones) {
    if (bone.parent == kNoParent) continue;
    const PresetBone* parent = PresetOf(region, bones.bones[size_t(bone.parent)].name);
    const bool turned = IsTurnedRound(PresetOf(region, bone.name), parent);
    if (turned ? parent->name == driver : LowerCase(bone.name) == driver) return bone.name;
  }
  return driver;
}

JointPlan FromPreset(const BoneSet& bones, const Bone& bone, Region region) {
  const PresetBone* preset = PresetOf(region, bone.name);
  const PresetBone* parent = PresetOf(region, bones.bones[size_t(bone.parent)].name);
  if (IsTurnedRound(preset, parent)) return {.dofs = parent->dofs, .conjunct_rotation = true};
  if (!preset) return {.dofs = kAllTurns};
  return {.dofs = preset->dofs,
          .driver = preset->driver.empty() ? "" : NameOfDriver(bones, region, preset->driver),
          .turns_about_head = preset->turns_about_head,
          .parallel_to_parent = preset->parallel_to_parent,
          .conjunct_rotation = true};
}

JointPlan PlanOf(const BoneSet& bones, const Bone& bone, Region region,
                 const std::vector<StudyJoint>& joints) {
  if (bone.parent == kNoParent) return {};
  JointPlan plan = FromPreset(bones, bone, region);
  if (joints.empty()) return plan;
  plan.dofs.clear();
  for (const StudyJoint& joint : joints) {
    if (joint.child == bone.name) plan.dofs = joint.dofs;
  }
  return plan;
}

}  // namespace

std::vector<JointPlan> PlanJoints(const BoneSet& bones, Region region,
                                  const std::vector<StudyJoint>& joints) {
  for (const StudyJoint& joint : joints) {
    const auto known = [&](const Bone& bone) { return bone.name == joint.child; };
    if (std::none_of(bones.bones.begin(), bones.bones.end(), known)) {
      throw InputError("joints: '" + joint.child + "' is not one of the study's bones");
    }
    if (joint.dofs.size() > kMostTurns && joint.dofs.size() != kTurnsAndShifts) {
      throw InputError(
          "joints: '" + joint.child +
          "' needs up to three degrees of freedom (turns) or six (three turns, then three shifts)");
    }
  }
  std::vector<JointPlan> plans;
  for (const Bone& bone : bones.bones) plans.push_back(PlanOf(bones, bone, region, joints));
  return plans;
}

}  // namespace kvx
