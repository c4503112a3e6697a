// What the scan says about where tissue lies that has been registered.
#pragma once
#include <span>

#include "kernels/block_level.h"

namespace kvx {

// Per cell of 2 x 2 x 2 voxels, the mean over its voxels of w g g^T (1/mm^2): half of it is by how much the
// squared intensity differences, in units of their spread, grow with the square of a voxel's move in the
// scan. g: slope of the scan where the voxel lies. It counts less where the images disagree by more than well
// registered tissue does. `scan_mm`: where every voxel of the level lies.
std::vector<Eigen::Matrix3f> PlaceInformation(const BlockLevel& level,
                                              std::span<const Eigen::Vector3f> scan_mm);

}  // namespace kvx
