// Compares limits and residuals with what bones are found to; nothing here changes the model.
#include "pipeline/model/warnings/joint_warnings.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/joint_values.h"
#include "pipeline/model/warnings/listed_names.h"
#include "pipeline/skeleton/bone_certainty.h"
#include "pipeline/skeleton/joint_axes.h"
#include "pipeline/skeleton/joint_chain.h"

namespace kvx {
namespace {

// What a joint's angles leave of its child's motion.
struct Stray {
  double turn_rad = 0, shift_mm = 0;
};

constexpr Stray kStrays{RadFromDeg(5), 3};
// A knee of one degree of freedom turns by 4 to 10 degrees about its shank as it bends, and rolls back.
constexpr Stray kStraysOfPreset{RadFromDeg(10), 5};

bool IsSureOf(const Joint& joint, const BoneFits& scan) {
  return !scan[size_t(joint.child)].Doubtful() && !scan[size_t(joint.parent)].Doubtful();
}

bool IsShown(const DegreeOfFreedom& dof, double limit_margin_rad) {
  return std::max(dof.max_rad, -dof.min_rad) - limit_margin_rad >= kShownTurnRad;
}

// Joints whose first axis is shown, or taken from one that is, also by way of others.
std::vector<bool> WithShownHinge(const std::vector<std::vector<ParallelJoint>>& neighbours,
                                 const Skeleton& skeleton, double limit_margin_rad) {
  std::vector<bool> with(skeleton.joints.size());
  std::vector<int> next;
  for (size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    if (!joint.dofs.empty() && IsShown(joint.dofs[0], limit_margin_rad)) next.push_back(int(j));
  }
  while (!next.empty()) {
    const size_t j = size_t(next.back());
    next.pop_back();
    if (with[j]) continue;
    with[j] = true;
    for (const ParallelJoint& n : neighbours[j]) next.push_back(n.bone);
  }
  return with;
}

Stray StrayOf(const Joint& joint, const Twist& residual) {
  return {residual.head<3>().norm(), ((Exp(residual) * joint.centre).lps - joint.centre.lps).norm()};
}

bool IsBeyond(const Stray& stray, const Stray& borne, const PoseBounds& child, const PoseBounds& parent) {
  return stray.turn_rad > std::max(borne.turn_rad, std::hypot(child.turn_rad, parent.turn_rad)) ||
         stray.shift_mm > std::max(borne.shift_mm, std::hypot(child.surface_mm, parent.surface_mm));
}

// The most of all scans that go beyond.
Stray MostStray(const BoneSet& bones, const SkeletonFit& fit, const Joint& joint, const Stray& borne,
                std::span<const BoneFits> scans) {
  const size_t child = size_t(joint.child), parent = size_t(joint.parent);
  Stray most;
  for (size_t k = 0; k < scans.size(); ++k) {
    if (!IsSureOf(joint, scans[k])) continue;
    const Stray stray = StrayOf(joint, fit.scan_residuals[k][child]);
    if (!IsBeyond(stray, borne, BoundsOf(bones.bones[child], scans[k][child]),
                  BoundsOf(bones.bones[parent], scans[k][parent])))
      continue;
    most.turn_rad = std::max(most.turn_rad, stray.turn_rad);
    most.shift_mm = std::max(most.shift_mm, stray.shift_mm);
  }
  return most;
}

}  // namespace

std::vector<std::string> StillJointWarnings(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                            const Skeleton& skeleton, double limit_margin_rad,
                                            std::span<const BoneFits> scans) {
  const std::vector<bool> with_hinge =
      WithShownHinge(TellingNeighbours(bones, plans), skeleton, limit_margin_rad);
  std::vector<std::string> by_shape, by_neighbours, doubtful;
  for (const Joint& joint : skeleton.joints) {
    const std::string& name = bones.bones[size_t(joint.child)].name;
    if (joint.dofs.empty()) continue;
    if (!scans.empty() && std::ranges::none_of(scans, [&](const auto& s) { return IsSureOf(joint, s); })) {
      doubtful.push_back(name);
      continue;
    }
    for (size_t d = 0; d < size_t(TurnsAmong(joint.dofs.size())); ++d) {
      if (IsShown(joint.dofs[d], limit_margin_rad)) continue;
      const bool as_neighbours = d == 0 && joint.dofs.size() < 3 && with_hinge[size_t(joint.child)];
      (as_neighbours ? by_neighbours : by_shape).push_back(name + "." + joint.dofs[d].name);
    }
  }
  const std::string still =
      "no scan in which both their bones are sure turns these joints by 5 degrees or more about these axes, "
      "so where the axes lie and point is taken from ";
  const std::string advice = "; give a scan that shows these turns before posing by them: ";
  std::vector<std::string> warnings = Naming(still + "the bones' shapes" + advice, by_shape);
  std::ranges::move(Naming(still + "the near parallel axes of the joints beside" + advice, by_neighbours),
                    std::back_inserter(warnings));
  std::ranges::move(
      Naming(
          "the bones of these joints are doubtful in every scan, so are their axes and limits; give a scan "
          "that shows the bones well before posing them: ",
          doubtful),
      std::back_inserter(warnings));
  return warnings;
}

std::vector<std::string> StrayingJointWarnings(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                               const SkeletonFit& fit, std::span<const BoneFits> scans) {
  std::vector<std::string> straying, fixed;
  for (const Joint& joint : fit.skeleton.joints) {
    const bool depends = joint.dofs.empty() && !joint.drivers.empty();
    if (joint.parent == kNoParent || depends) continue;
    const bool as_usual = plans[size_t(joint.child)].conjunct_rotation && !joint.dofs.empty();
    const Stray most = MostStray(bones, fit, joint, as_usual ? kStraysOfPreset : kStrays, scans);
    if (most.turn_rad == 0 && most.shift_mm == 0) continue;
    (joint.dofs.empty() ? fixed : straying)
        .push_back(bones.bones[size_t(joint.child)].name + " (by up to " +
                   std::to_string(std::lround(DegFromRad(most.turn_rad))) + " degrees and " +
                   std::to_string(std::lround(most.shift_mm)) + " mm)");
  }
  std::vector<std::string> warnings = Naming(
      "in the scans these bones turn or shift beyond what the angles of their joints say; posing gives that "
      "back at the scans' own angles and interpolates it in between; to ask for it by itself, give these "
      "joints 3 or 6 degrees of freedom in the study's joints, or the bones the parents that they move "
      "with: ",
      straying);
  std::ranges::move(
      Naming("the scans move these bones, whose joints have no degrees of freedom: posing moves "
             "them with the other joints' angles as the scans show it, and no angle asks for "
             "that by itself; where one should, give these joints degrees of freedom in the "
             "study's joints, or the bones the parents that they move with: ",
             fixed),
      std::back_inserter(warnings));
  return warnings;
}

}  // namespace kvx
