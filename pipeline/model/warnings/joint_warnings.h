// What a user is told about joints: of which the scans say little, and that the scans contradict.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "pipeline/skeleton/fit_skeleton.h"
#include "pipeline/skeleton/joint_plan.h"

namespace kvx {

// A line for the degrees of freedom that no scan turns by 5 degrees, whose axes and where those point come
// from the bones' boxes; one for those where they come from near parallel joints; one for the joints of which
// no scan is sure. `limit_margin_rad`: what the skeleton's limits hold beside the scans' angles.
std::vector<std::string> StillJointWarnings(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                            const Skeleton& skeleton, double limit_margin_rad,
                                            std::span<const BoneFits> scans);

// A line for the joints whose angles leave more than 5 degrees or 3 mm of their bones' motion in a scan, and
// more than the bounds of both bones do, and one for fixed joints of which that is so: they lack degrees of
// freedom. Of a preset's joint 10 degrees and 5 mm are conjunct rotation, gliding and play. Dependent bones
// have none to lack.
std::vector<std::string> StrayingJointWarnings(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                               const SkeletonFit& fit, std::span<const BoneFits> scans);

}  // namespace kvx
