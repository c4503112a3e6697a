// Study, preset, or three axes.
#include "pipeline/skeleton/joint_plan.h"

#include <algorithm>

#include "core/errors.h"
#include "core/joint_values.h"
#include "core/region_presets.h"
#include "core/text/lower_case.h"

namespace kvx {
namespace {

const std::vector<std::string> kAllTurns{"flexion", "abduction", "rotation"};  // where nothing is known

// A tree that hangs on another bone than the preset's has some of its joints the other way round.
bool IsTurnedRound(const PresetBone* child, const PresetBone* parent) {
  return child && parent && parent->parent == child->name;
}

// The bone whose joint is that between `driver` and its parent in the preset.
std::string NameOfDriver(const BoneSet& bones, Region region, const std::string& driver) {
  for (const Bone& bone : bones.bones) {
    if (bone.parent == kNoParent) continue;
    const PresetBone* parent = FindPreset(region, bones.bones[size_t(bone.parent)].name);
    const bool turned = IsTurnedRound(FindPreset(region, bone.name), parent);
    if (turned ? parent->name == driver : LowerCase(bone.name) == driver) return bone.name;
  }
  return driver;
}

std::vector<ParallelJoint> ParallelTo(const BoneSet& bones, const Bone& bone, const PresetBone& preset) {
  std::vector<ParallelJoint> joints;
  for (const ParallelAxis& axis : preset.parallel) {
    for (int b = 0; b < bones.size(); ++b) {
      if (axis.of.empty() ? b == bone.parent : LowerCase(bones.bones[size_t(b)].name) == axis.of)
        joints.push_back({b, axis.spread_rad, axis.learnt, axis.along_rad});
    }
  }
  return joints;
}

JointPlan FromPreset(const BoneSet& bones, const Bone& bone, Region region) {
  const PresetBone* preset = FindPreset(region, bone.name);
  const PresetBone* parent = FindPreset(region, bones.bones[size_t(bone.parent)].name);
  if (IsTurnedRound(preset, parent)) return {.dofs = parent->dofs, .conjunct_rotation = true};
  if (!preset) return {.dofs = kAllTurns};
  return {.dofs = preset->dofs,
          .driver = preset->driver.empty() ? "" : NameOfDriver(bones, region, preset->driver),
          .turns_about_head = preset->turns_about_head,
          .parallel = ParallelTo(bones, bone, *preset),
          .conjunct_rotation = true};
}

JointPlan PlanOf(const BoneSet& bones, const Bone& bone, Region region,
                 const std::vector<StudyJoint>& joints) {
  if (bone.parent == kNoParent) return {};
  JointPlan plan = FromPreset(bones, bone, region);
  const auto listed = std::ranges::find(joints, bone.name, &StudyJoint::child);
  if (listed != joints.end())
    plan.dofs = listed->dofs, plan.driver.clear();  // it follows its own angles, or its parent alone
  else if (!joints.empty() && !FindPreset(region, bone.name))
    plan.dofs.clear();
  return plan;
}

void RequireOfAChild(const BoneSet& bones, const StudyJoint& joint) {
  const auto bone = std::ranges::find(bones.bones, joint.child, &Bone::name);
  if (bone == bones.bones.end()) throw InputError("'" + joint.child + "' is not one of the study's bones");
  if (bone->parent == kNoParent)
    throw InputError("'" + joint.child +
                     "' is the root bone and has no joint; name the bone on the other side of the joint");
}

}  // namespace

std::vector<JointPlan> PlanJoints(const BoneSet& bones, Region region,
                                  const std::vector<StudyJoint>& joints) {
  for (const StudyJoint& joint : joints) {
    RequireOfAChild(bones, joint);
    if (joint.dofs.size() > kMostTurns && joint.dofs.size() != kTurnsAndShifts) {
      throw InputError(
          "'" + joint.child +
          "' needs up to three degrees of freedom (turns) or six (three turns, then three shifts)");
    }
  }
  std::vector<JointPlan> plans;
  for (const Bone& bone : bones.bones) plans.push_back(PlanOf(bones, bone, region, joints));
  return plans;
}

}  // namespace kvx
