// The volumetric weight map of VBD (eq. 2):
// at most four bones per voxel, weights >= 0 that sum to 1 everywhere.
#pragma once
#include <array>

#include "core/image.h"

namespace kvx {

constexpr int kBonesPerVoxel = 4;

struct VoxelWeights {
  std::array<uint8_t, kBonesPerVoxel>
      bones{};  // indices into BoneSet, largest weight first; unused ones repeat with weight 0
  std::array<float, kBonesPerVoxel> weights{};
};

using WeightMap = Image<VoxelWeights>;  // on the template grid

}  // namespace kvx
