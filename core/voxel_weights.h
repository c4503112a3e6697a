// The sparse weights of one voxel: the four largest, largest first, that sum to 1.
#pragma once
#include "core/weight_map.h"

namespace kvx {

// Keeps the largest four, largest first; of equal ones the bone that came first.
void Insert(VoxelWeights& voxel, uint8_t bone, float weight);
// Partition of unity; unused slots repeat the first bone with weight 0.
void Normalise(VoxelWeights& voxel);
VoxelWeights Rigid(uint8_t bone);

}  // namespace kvx
