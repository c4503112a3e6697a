// Study, preset, or three axes.
#include "pipeline/skeleton/joint_plan.h"

#include <algorithm>

#include "core/errors.h"
#include "core/joint_values.h"
#include "pipeline/bones/region_presets.h"

namespace kvx {
namespace {

JointPlan FromPreset(Region region, const std::string& bone) {
  for (const PresetBone& preset : RegionPreset(region)) {
    if (preset.name == bone)
      return {.dofs = preset.dofs,
              .driver = preset.driver,
              .turns_about_head = preset.turns_about_head,
              .parallel_to_parent = preset.parallel_to_parent,
              .conjunct_rotation = true};
  }
  return {};
}

JointPlan PlanOf(const Bone& bone, Region region, const std::vector<StudyJoint>& joints) {
  if (bone.parent == kNoParent) return {};
  if (joints.empty() && region == Region::kCustom) return {.dofs = {"flexion", "abduction", "rotation"}};
  JointPlan plan = FromPreset(region, bone.name);
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
  for (const Bone& bone : bones.bones) plans.push_back(PlanOf(bone, region, joints));
  return plans;
}

}  // namespace kvx
