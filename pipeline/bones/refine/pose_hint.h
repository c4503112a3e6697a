// Initial poses that a user gives for bones: how near a bone has to lie for one to speak for it, and how much
// it says there.
#pragma once
#include <map>
#include <string>

#include "core/bone.h"
#include "core/pose.h"

namespace kvx {

using PoseHints = std::map<std::string, RigidTransform>;  // scan_from_template by bone name

// Whether a scan on this grid can show bones that hang together with one there: it lies no farther beyond the
// grid than half as far again as the template's bones reach, as those of a fist do when it opens.
bool MayBeMeant(const BoneSet& bones, const RigidTransform& hint, int bone, const Grid& scan);

// Whether `pose` is what the hint means: within half of the bone's thickness, as PoseDistanceMm has it. A
// turn of a round bone about its length hardly counts there, as it hardly shows.
bool IsNearHint(const Bone& bone, const RigidTransform& hint, const RigidTransform& pose);

// The fit with what a hint near it says: normal about the hint, by 5 degrees about and by a sixth of the
// bone's thickness along each axis. It decides what the scan does not (how a round bone is turned about
// itself), and moves a pose that the scan decides by a few thousandths of the way. Pose and covariance
// change.
void WeighHint(const Bone& bone, const RigidTransform& hint, BoneFit& fit);

}  // namespace kvx
