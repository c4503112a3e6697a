// Blocks with strokes in them and beside them.
#include "pipeline/segmentation/finish_bone.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr int kBone = 3;

LabelMap Empty() {
  Grid grid;
  grid.size = {30, 16, 16};
  return LabelMap(grid);
}

void Fill(LabelMap& labels, const VoxelBox& box) {
  ForEachVoxel(box, labels.grid, [&](const auto&, size_t, size_t whole) { labels.values[whole] = kBone; });
}

std::vector<std::string> DoubtsOf(const LabelMap& bone, const LabelMap& strokes) {
  const VoxelBox whole{{0, 0, 0}, bone.grid.size};
  return FinishBone(bone, strokes, kBone, whole).doubts;
}

TEST(FinishBone, AStrokeThatSticksOutOfTheBoneIsDoubtful) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {15, 12, 12}});
  Fill(strokes, {{6, 7, 7}, {12, 8, 8}});
  EXPECT_TRUE(DoubtsOf(bone, strokes).empty());
  Fill(strokes, {{13, 6, 6}, {24, 7, 7}});
  const std::vector<std::string> doubts = DoubtsOf(bone, strokes);
  ASSERT_EQ(doubts.size(), 1u);
  EXPECT_NE(doubts[0].find("more strokes in that part"), std::string::npos);
}

TEST(FinishBone, AStrokeOnTheBonesSurfaceIsNot) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 3}, {15, 12, 12}});
  Fill(strokes, {{4, 3, 7}, {14, 4, 8}});
  EXPECT_TRUE(DoubtsOf(bone, strokes).empty());
}

TEST(FinishBone, ABoneThatIsThinAllOverIsNot) {
  LabelMap bone = Empty(), strokes = Empty();
  Fill(bone, {{3, 3, 7}, {25, 14, 9}});
  Fill(strokes, {{4, 5, 7}, {16, 6, 8}});
  EXPECT_TRUE(DoubtsOf(bone, strokes).empty());
}

}  // namespace
}  // namespace kvx
