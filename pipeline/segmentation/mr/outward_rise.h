// How well a bone's surface in MR lies on the outer side of its dark cortex.
#pragma once
#include "pipeline/segmentation/voxel_box.h"

namespace kvx {

// The mean over the faces of the mask's surface of how much brighter it is one voxel outside than just
// inside, in parts of `level`; a single face says 0.3 at most. About 0.15 to 0.25 around a hand's bones;
// near 0 where the surface lies anywhere else. -1 for an empty mask. The mask lies on the grid of the box.
double OutwardRise(const Volume& scan, double level, const VoxelBox& box, const Mask& mask);

}  // namespace kvx
