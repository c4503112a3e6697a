// Which way the axes of all joints point.
#pragma once
#include <vector>

#include "pipeline/skeleton/joint_chain.h"

namespace kvx {

// An axis points so that the scans turn about it by a positive angle on average; first axes of near parallel
// joints point the same way, by the sum of all their angles, so that one sign bends a whole finger. Where
// none turns by 5 degrees: a first axis so that the bone bends away from one that follows it on the same
// parent (a tibia from the patella), else along the axis of the bone's box that is nearest to it, of such
// joints the first one's; a second axis as the box has it beside the first (SecondFromBox); a third as the
// cross product of the two. Neither the sign of an eigenvector nor the order of the scans says anything.
// `motions`: per bone those that tell.
void OrientAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                const std::vector<std::vector<RelativeMotion>>& motions, std::vector<FittedAxes>& joints);

}  // namespace kvx
