// Boxes of which overlaps can be counted.
#include "pipeline/segmentation/strokes/expected_dice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace kvx {
namespace {

// All of its box but `without`, in the voxels of the scan.
FoundBone Block(const VoxelBox& box, const VoxelBox& without = {}) {
  Grid scan;
  scan.size = {40, 40, 40};
  FoundBone bone{.label = 1, .box = box, .mask = Mask(GridOf(box, scan))};
  ForEachVoxel(box, scan, [&](const auto& p, size_t part, size_t) {
    bone.mask.values[part] = !without.Contains(p + box.low);
  });
  return bone;
}

TEST(Dice, CountsVoxelsOfTheScanWhateverTheBoxes) {
  const FoundBone a = Block({{2, 2, 2}, {6, 6, 6}}),
                  b = Block({{4, 0, 0}, {10, 8, 8}}, {{9, 0, 0}, {10, 8, 8}});
  EXPECT_DOUBLE_EQ(Dice(a, b), 2.0 * 32 / (64 + 320));
  EXPECT_DOUBLE_EQ(Dice(b, a), Dice(a, b));
  EXPECT_DOUBLE_EQ(Dice(a, a), 1);
  EXPECT_DOUBLE_EQ(Dice(a, Block({{20, 20, 20}, {24, 24, 24}})), 0);
  const FoundBone empty = Block({{2, 2, 2}, {6, 6, 6}}, {{2, 2, 2}, {6, 6, 6}});
  EXPECT_DOUBLE_EQ(Dice(a, empty), 0);
  EXPECT_DOUBLE_EQ(Dice(empty, empty), 0);
}

TEST(Agreement, IsTheMeanOverTheOtherAnswers) {
  const FoundBone a = Block({{2, 2, 2}, {6, 6, 6}}), half = Block({{2, 2, 2}, {6, 6, 4}}),
                  none = Block({{9, 9, 9}, {10, 10, 10}});
  const std::vector<FoundBone> answers{half, a, none};
  EXPECT_DOUBLE_EQ(Agreement(answers, 1), (2.0 * 32 / 96 + 0) / 2);
  EXPECT_DOUBLE_EQ(Agreement(std::span(answers).first(1), 0), 1) << "nobody disagrees";
}

TEST(ExpectedDice, GrowsWithEverySignOfAnAnswerThatHolds) {
  EXPECT_NEAR(ExpectedDice({}), 1, 1e-12);
  const SearchSigns usual{.agreement = 0.8, .stayed = 0.85, .unclear = 0.3, .marked = 0.2, .bare = false};
  const std::vector<std::function<void(SearchSigns&)>> worse{
      [](SearchSigns& s) { s.agreement = 0.5; }, [](SearchSigns& s) { s.stayed = 0.6; },
      [](SearchSigns& s) { s.unclear = 0.7; }, [](SearchSigns& s) { s.marked = 0.5; },
      [](SearchSigns& s) { s.bare = true; }};
  for (const auto& make_worse : worse) {
    SearchSigns signs = usual;
    make_worse(signs);
    EXPECT_LT(ExpectedDice(signs), ExpectedDice(usual));
  }
  SearchSigns dark = usual;
  dark.dark_inside = 0.3;
  EXPECT_EQ(ExpectedDice(dark), ExpectedDice(usual)) << "thick cortex where muscle is bright";
  dark.dark_muscle = 0.6;
  EXPECT_NEAR(ExpectedDice(dark), ExpectedDice(usual) - 0.33 * 0.3 * std::sqrt(0.6), 1e-12);
  EXPECT_GT(DoubtfulDice(dark.dark_muscle), DoubtfulDice(usual.dark_muscle));
  EXPECT_GE(ExpectedDice({.agreement = 0, .stayed = 0, .unclear = 1, .marked = 1, .bare = true}), 0);
}

}  // namespace
}  // namespace kvx
