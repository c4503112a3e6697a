// What is told of segmented bones, and by which names.
#include "pipeline/segmentation/segment_bones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

SegmentedBones TwoKneeBones() {
  Grid grid;
  grid.size = {12, 12, 40};
  SegmentedBones bones{.labels = LabelMap(grid), .expected_dice = {{2, 0.71}}};
  for (int k = 0; k < 40; ++k) bones.labels(6, 6, k) = k < 18 ? 1 : k > 20 ? 2 : 0;
  bones.warnings.emplace_back("the whole: look at it");
  bones.doubts.emplace_back(2, "look at it");
  bones.doubts.emplace_back(1, "and at this");
  return bones;
}

TEST(SegmentBones, BonesAreToldOfByTheNamesThatAreSure) {
  const SegmentedBones bones = TwoKneeBones();
  EXPECT_THAT(WarningsOf(bones, std::map<int, std::string>{{1, "femur"}}),
              testing::ElementsAre("the whole: look at it", "bone 2: look at it", "bone femur: and at this"));
  const std::vector<ProposedBone> named{{.label = 1, .name = "femur", .confidence = 0.4},
                                        {.label = 2, .name = "tibia", .confidence = 0.6}};
  EXPECT_THAT(WarningsOf(bones, named),
              testing::ElementsAre("the whole: look at it", "bone tibia: look at it", "bone 1: and at this"));
}

TEST(SegmentBones, ADoubtOfSeveralBonesIsToldOnce) {
  SegmentedBones bones = TwoKneeBones();
  bones.doubts.emplace_back(4, "look at it");
  EXPECT_THAT(
      WarningsOf(bones, std::map<int, std::string>{{2, "tibia"}}),
      testing::ElementsAre("the whole: look at it", "bones tibia, 4: look at it", "bone 1: and at this"));
}

TEST(SegmentBones, WhatIsExpectedOfABoneIsToldWithItsName) {
  const std::vector<ProposedBone> named = NamesOf(TwoKneeBones(), Region::kKnee);
  ASSERT_EQ(named.size(), 2u);
  EXPECT_FALSE(named[0].expected_dice);
  EXPECT_EQ(named[1].expected_dice, 0.71);
}

TEST(SegmentBones, AScanIsNoPreviousLabelMap) {
  const testing_support::ScratchFolder folder;
  const auto file = folder.path() / "previous.nrrd";
  LabelMap map = TwoKneeBones().labels;
  WriteLabels(file, map);
  EXPECT_EQ(ReadPreviousLabels(file, map.grid).values, map.values);
  for (size_t v = 0; v < map.values.size(); ++v) map.values[v] = uint16_t(v * 2654435761u >> 7 & 255);
  WriteLabels(file, map);
  EXPECT_THAT(testing_support::RefusalOf<InputError>([&] { ReadPreviousLabels(file, map.grid); }),
              testing::HasSubstr("previous label map holds greys"));
}

}  // namespace
}  // namespace kvx
