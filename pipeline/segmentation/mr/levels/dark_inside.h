// Cortex lies under a bone's surface. What is dark deeper inside was likelier taken from elsewhere.
#pragma once
#include "core/voxels/voxel_box.h"

namespace kvx {

// Of the voxels more than 1.5 voxels below the mask's surface, the share darker than marrow is; 0 without
// any. `level`: intensity of the bone's marrow. The mask lies on the grid of the box.
double DarkInside(const Volume& scan, double level, const VoxelBox& box, const Mask& mask);

}  // namespace kvx
