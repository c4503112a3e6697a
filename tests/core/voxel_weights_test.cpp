// The four largest of more, in order, and their sum.
#include "core/voxel_weights.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

using Bones = std::array<uint8_t, kBonesPerVoxel>;
using Weights = std::array<float, kBonesPerVoxel>;

TEST(VoxelWeights, KeepTheLargestFourLargestFirst) {
  VoxelWeights voxel;
  for (const auto& [bone, weight] :
       {std::pair(1, 2.0f), {2, 5.0f}, {3, 1.0f}, {4, 4.0f}, {5, 3.0f}, {6, 0.5f}})
    Insert(voxel, uint8_t(bone), weight);
  EXPECT_EQ(voxel.bones, (Bones{2, 4, 5, 1}));
  EXPECT_EQ(voxel.weights, (Weights{5, 4, 3, 2}));
}

TEST(VoxelWeights, OfEqualOnesTheFirstComesFirst) {
  VoxelWeights voxel;
  for (const uint8_t bone : {9, 7, 8, 6, 5}) Insert(voxel, bone, 1);
  EXPECT_EQ(voxel.bones, (Bones{9, 7, 8, 6}));
}

TEST(VoxelWeights, SumToOneAndRepeatTheFirstBoneWhereUnused) {
  VoxelWeights voxel;
  Insert(voxel, 4, 1);
  Insert(voxel, 2, 3);
  Normalise(voxel);
  EXPECT_EQ(voxel.bones, (Bones{2, 4, 2, 2}));
  EXPECT_EQ(voxel.weights, (Weights{0.75, 0.25, 0, 0}));
}

TEST(VoxelWeights, ARigidVoxelIsOneBonesAlone) {
  EXPECT_EQ(Rigid(3).bones, (Bones{3, 3, 3, 3}));
  EXPECT_EQ(Rigid(3).weights, (Weights{1, 0, 0, 0}));
}

}  // namespace
}  // namespace kvx
