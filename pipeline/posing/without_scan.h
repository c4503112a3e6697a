// A scan as the others lead to expect it.
#pragma once
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

// By EVD, the pose of a training scan's bones by a pose space (of these options) that has not seen it: its
// own coefficients are 0. Joint centres and axes stay those of all scans.
ResolvedPose ResolveWithout(const PoseResolver& model, const PoseSpaceOptions& options,
                            const ExampleMoments& moments, int scan);

}  // namespace kvx
