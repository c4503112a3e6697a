// Insertion into four sorted slots.
#include "core/voxel_weights.h"

#include <utility>

namespace kvx {

void Insert(VoxelWeights& voxel, uint8_t bone, float weight) {
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (weight <= voxel.weights[s]) continue;
    std::swap(weight, voxel.weights[s]);
    std::swap(bone, voxel.bones[s]);
  }
}

void Normalise(VoxelWeights& voxel) {
  double sum = 0;
  for (const float w : voxel.weights) sum += w;
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    voxel.weights[s] = float(voxel.weights[s] / sum);
    if (voxel.weights[s] == 0.0f) voxel.bones[s] = voxel.bones[0];
  }
}

VoxelWeights Rigid(uint8_t bone) { return {{bone, bone, bone, bone}, {1.0f, 0.0f, 0.0f, 0.0f}}; }

}  // namespace kvx
