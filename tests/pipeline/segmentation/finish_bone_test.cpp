// Blocks with strokes in them and beside them.
#include "pipeline/segmentation/finish_bone.h"

#include <gtest/gtest.h>

#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

constexpr int kBone = 3;

LabelMap Empty() {
  Grid grid;
  grid.size = {30, 16, 16};
  return LabelMap(grid);
}

void Fill(LabelMap& labels, const VoxelBox& box, int label = kBone) {
  ForEachVoxel(box, labels.grid,
               [&](const auto&, size_t, size_t whole) { labels.values[whole] = uint16_t(label); });
}

size_t CountIn(const Mask& mask, const VoxelBox& box) {
  size_t count = 0;
  ForEachVoxel(box, mask.grid, [&](const auto&, size_t, size_t whole) { count += mask.values[whole]; });
  return count;
}

BoneFinish Finished(const LabelMap& bone, const LabelMap& strokes) {
  const VoxelBox whole{{0, 0, 0}, bone.grid.size};
  return FinishBone(bone, strokes, kBone, whole);
}

TEST(FinishBone, AStrokeThatSticksOutOfTheBoneIsDoubtful) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {15, 12, 12}});
  Fill(strokes, {{6, 7, 7}, {12, 8, 8}});
  EXPECT_FALSE(Finished(bone, strokes).bare);
  Fill(strokes, {{13, 6, 6}, {24, 7, 7}});
  const BoneFinish finish = Finished(bone, strokes);
  EXPECT_TRUE(finish.bare);
  EXPECT_LT(finish.marked, kMostlyMarked);
}

TEST(FinishBone, SaysHowMuchOfTheBoneIsMarked) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {9, 9, 9}});
  Fill(strokes, {{4, 4, 4}, {6, 7, 8}});
  const VoxelBox whole{{0, 0, 0}, bone.grid.size};
  EXPECT_DOUBLE_EQ(FinishBone(bone, strokes, kBone, whole, false).marked, 24.0 / 216.0);
  EXPECT_DOUBLE_EQ(FinishBone(strokes, strokes, kBone, whole, false).marked, 1.0);
}

TEST(FinishBone, AStrokeOnTheBonesSurfaceIsNot) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {15, 12, 12}});
  Fill(strokes, {{4, 3, 7}, {14, 4, 8}});
  EXPECT_FALSE(Finished(bone, strokes).bare);
}

TEST(FinishBone, ABoneThatIsThinAllOverIsNot) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 7}, {25, 14, 9}});
  Fill(strokes, {{4, 5, 7}, {16, 6, 8}});
  EXPECT_FALSE(Finished(bone, strokes).bare);
}

// Deep in a bone, where every voxel around is bone: neither a hole nor a rough place may take it back.
TEST(FinishBone, NoVoxelOfAnotherStrokeIsGiven) {
  for (const int other : {int(kBackgroundStroke), kBone + 1}) {
    for (const bool calm : {false, true}) {
      LabelMap bone = Empty(), strokes = Empty();
      const VoxelBox block{{3, 3, 3}, {23, 13, 13}}, line{{10, 8, 8}, {19, 9, 9}},
          whole{{0, 0, 0}, bone.grid.size};
      Fill(bone, block);
      Fill(strokes, {{5, 6, 6}, {15, 7, 7}});
      Fill(strokes, line, other);
      const Mask found = FinishBone(bone, strokes, kBone, whole, calm).mask;
      EXPECT_EQ(CountIn(found, line), 0u) << other << calm;
      EXPECT_EQ(CountIn(found, {{5, 6, 6}, {15, 7, 7}}), 10u) << other << calm;
      EXPECT_GT(CountIn(found, block), 1800u) << other << calm;  // 2000 - 9; calm, edges are rounded
    }
  }
}

TEST(FinishBone, AHoleStaysOnlyWhereTheBackgroundWasMarked) {
  const VoxelBox hole{{9, 6, 6}, {14, 10, 10}}, whole{{0, 0, 0}, Empty().grid.size};
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {23, 13, 13}});
  Fill(bone, hole, 0);
  Fill(strokes, {{4, 4, 4}, {20, 5, 5}});
  EXPECT_EQ(CountIn(FinishBone(bone, strokes, kBone, whole, false).mask, hole), 80u);
  Fill(strokes, {{11, 8, 8}, {12, 9, 9}}, kBackgroundStroke);
  EXPECT_EQ(CountIn(FinishBone(bone, strokes, kBone, whole, false).mask, hole), 0u);
}

// The background marked all around a part of the bone cuts it off.
TEST(FinishBone, WhatOtherStrokesCutOffIsGone) {
  const VoxelBox whole{{0, 0, 0}, Empty().grid.size}, beyond{{15, 3, 3}, {23, 13, 13}};
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {23, 13, 13}});
  Fill(strokes, {{5, 6, 6}, {11, 7, 7}});
  Fill(strokes, {{13, 2, 2}, {15, 14, 14}}, kBackgroundStroke);
  for (const bool calm : {false, true})
    EXPECT_EQ(CountIn(FinishBone(bone, strokes, kBone, whole, calm).mask, beyond), 0u) << calm;
}

}  // namespace
}  // namespace kvx
