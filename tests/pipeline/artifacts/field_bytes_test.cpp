// What artefacts look like in bytes.
#include "pipeline/artifacts/core_fields.h"

#include <gtest/gtest.h>

#include <cstring>

namespace kvx {
namespace {

std::string Raw(const auto& value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

TEST(FieldBytes, WeightsAreStoredAsBonesThenWeightsVoxelByVoxel) {
  std::vector<VoxelWeights> weights = {{{3, 1, 3, 3}, {0.75f, 0.25f, 0, 0}}, {{2, 2, 2, 2}, {1, 0, 0, 0}}};
  std::string expected = Raw(uint64_t(2));
  for (const VoxelWeights& voxel : weights) {
    for (const uint8_t bone : voxel.bones) expected += Raw(bone);
    for (const float weight : voxel.weights) expected += Raw(weight);
  }
  EXPECT_EQ(BytesOf(weights).view(), expected);
}

TEST(FieldBytes, WhatIsWrittenIsReadAgain) {
  Bone bone;
  bone.label = 7, bone.name = "tibia", bone.voxels = 1234;
  bone.centroid.lps = {1, -2.5, 3};
  std::map<std::string, std::vector<double>> numbers = {{"a", {1, 2}}, {"b", {}}};
  ByteCounter counter;
  counter(bone, numbers);
  ByteWriter writer(counter.count);
  writer(bone, numbers);
  const RawBytes written = std::move(writer).Written();
  Bone read;
  std::map<std::string, std::vector<double>> numbers_read;
  ByteReader reader(written.view());
  reader(read, numbers_read);
  EXPECT_TRUE(reader.AtEnd());
  EXPECT_EQ(read.name, bone.name);
  EXPECT_EQ(read.voxels, bone.voxels);
  EXPECT_EQ(read.centroid.lps, bone.centroid.lps);
  EXPECT_EQ(numbers_read, numbers);
  ByteReader cut(written.view().substr(0, written.size - 1));
  EXPECT_THROW(cut(read, numbers_read), Unavailable);
}

TEST(FieldBytes, WhatAnEarlierVersionDidNotStoreIsLeftAsItIs) {
  BoneSet set;
  set.bones = {{.label = 7, .name = "tibia"}};
  set.mending.unused_labels = {3}, set.mending.shared_voxels = {2};
  std::string bytes(BytesOf(set).view());
  BoneSet read, third;
  ByteReader{bytes}(read);
  EXPECT_EQ(read.mending.unused_labels, set.mending.unused_labels);
  EXPECT_EQ(read.mending.shared_voxels, set.mending.shared_voxels);
  bytes.resize(bytes.size() - BytesOf(set.mending.shared_voxels).size);
  ByteReader{bytes}(third);
  EXPECT_EQ(third.mending.unused_labels, set.mending.unused_labels);
  EXPECT_TRUE(third.mending.shared_voxels.empty());
  bytes.resize(bytes.size() - BytesOf(set.mending).size);
  BoneSet earlier;
  ByteReader{bytes}(earlier);
  EXPECT_EQ(earlier.bones[0].name, "tibia");
  EXPECT_TRUE(earlier.mending.unused_labels.empty());
  bytes.pop_back();
  EXPECT_THROW(ByteReader{bytes}(earlier), Unavailable);
}

}  // namespace
}  // namespace kvx
