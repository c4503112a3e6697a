// Boxes of voxels as bones, and strokes drawn across them.
#include "pipeline/segmentation/strokes/stroke_doubts.h"

#include <gtest/gtest.h>

#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

using Voxel = Eigen::Vector3i;

struct Drawing {
  LabelMap labels, strokes;
};

Grid SmallGrid() {
  Grid grid;
  grid.size = {24, 16, 12};
  grid.spacing_mm = {0.7, 1.1, 2.3};
  return grid;
}

void Fill(LabelMap& map, const VoxelBox& box, int label) {
  ForEachVoxel(box, [&](const Voxel& p) { map(p.x(), p.y(), p.z()) = uint16_t(label); });
}

// A stroke has the last word, as in what is found.
void Draw(Drawing& drawing, const VoxelBox& box, int stroke) {
  Fill(drawing.strokes, box, stroke);
  Fill(drawing.labels, box, stroke == kBackgroundStroke ? 0 : stroke);
}

// Bone 1 on the left, bone 2 on the right, a gap of a voxel between them.
Drawing TwoBones() {
  Drawing drawing{LabelMap(SmallGrid()), LabelMap(SmallGrid())};
  Fill(drawing.labels, {{1, 1, 1}, {12, 15, 11}}, 1);
  Fill(drawing.labels, {{13, 1, 1}, {23, 15, 11}}, 2);
  return drawing;
}

using Within = std::map<int, size_t>;

TEST(StrokesWithin, AreThoseOfSomethingElseThatABoneIsAllAround) {
  Drawing drawing = TwoBones();
  Draw(drawing, {{4, 7, 5}, {9, 8, 6}}, kBackgroundStroke);
  EXPECT_EQ(StrokesWithin(drawing.labels, drawing.strokes), (Within{{1, 5}}));
  Draw(drawing, {{16, 4, 4}, {18, 6, 7}}, 1);  // thicker than a line: all of its voxels lie at its border
  EXPECT_EQ(StrokesWithin(drawing.labels, drawing.strokes), (Within{{1, 5}, {2, 12}}));
}

TEST(StrokesWithin, AStrokeThatLeavesTheBoneIsInItAsFarAsItIs) {
  Drawing drawing = TwoBones();
  Draw(drawing, {{6, 10, 5}, {7, 16, 6}}, kBackgroundStroke);  // its last voxel lies outside
  EXPECT_EQ(StrokesWithin(drawing.labels, drawing.strokes), (Within{{1, 5}}));
}

TEST(StrokesWithin, NotItsOwnNorThoseBesideItOrBetweenTwo) {
  Drawing drawing = TwoBones();
  Draw(drawing, {{4, 7, 5}, {9, 8, 6}}, 1);
  Draw(drawing, {{12, 3, 3}, {13, 12, 4}}, kBackgroundStroke);  // in the gap
  Draw(drawing, {{2, 0, 4}, {9, 1, 5}}, kBackgroundStroke);     // along the surface
  Draw(drawing, {{6, 3, 0}, {7, 4, 12}}, kBackgroundStroke);    // in a canal through the bone
  EXPECT_TRUE(StrokesWithin(drawing.labels, drawing.strokes).empty());
}

size_t Apart(const Drawing& drawing, int label) {
  return StrokesApart(drawing.labels, drawing.strokes, label, BoxOf(drawing.labels, label));
}

TEST(StrokesApart, AreThoseInPiecesThatTheLargestDoesNotTouch) {
  Drawing drawing = TwoBones();
  Draw(drawing, {{3, 3, 3}, {9, 4, 4}}, 1);
  EXPECT_EQ(Apart(drawing, 1), 0u);
  Fill(drawing.labels, {{7, 1, 1}, {8, 15, 11}}, 0);  // cut in two: 6 and 4 voxels wide
  EXPECT_EQ(Apart(drawing, 1), 1u);                   // of the stroke 4 voxels, the cut, and 1
  Draw(drawing, {{9, 6, 6}, {12, 7, 7}}, 1);
  EXPECT_EQ(Apart(drawing, 1), 4u);
  EXPECT_EQ(Apart(drawing, 2), 0u);
}

TEST(StrokesApart, PiecesThatTouchCornerToCornerAreOne) {
  Drawing drawing = TwoBones();
  Fill(drawing.labels, {{13, 1, 1}, {23, 15, 11}}, 0);
  for (int n = 0; n < 8; ++n) Draw(drawing, {{12 + n, 4 + n, 4}, {13 + n, 5 + n, 5}}, 1);
  EXPECT_EQ(Apart(drawing, 1), 0u);
  Fill(drawing.labels, {{14, 6, 4}, {15, 7, 5}}, 0);
  EXPECT_EQ(Apart(drawing, 1), 5u);
}

}  // namespace
}  // namespace kvx
