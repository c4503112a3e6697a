// The body goes on where the scan ends.
#pragma once
#include "pipeline/skinning/harmonic_levels.h"

namespace kvx {

struct ContinuedRoles {
  RoleMap roles;
  Eigen::Vector3i first = Eigen::Vector3i::Zero();  // its voxel that is the scan's voxel 0
};

// Beyond every side that the body reaches its last plane is repeated, bones and all, over part of the width
// that it is cut at. Weights would have no slope at such a side otherwise, and those of a bone that lies
// farther in twice what they are in a limb that goes on. At most kMostContinued times the voxels.
ContinuedRoles Continued(const RoleMap& roles);

constexpr double kMostContinued = 2;

}  // namespace kvx
