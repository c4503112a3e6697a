// Strokes in a bar of marrow, and strokes that stick out of it.
#include "pipeline/segmentation/strokes/stroke_reach.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr GeodesicOptions kOptions{.mm_per_contrast = 100, .noise = 0.05, .most_mm = 500};

// 64 mm long along x; marrow up to `marrow_mm`, dark from there on.
Volume Bar(int marrow_mm) {
  Grid grid;
  grid.size = {64, 3, 3};
  Volume relative(grid, 1.0f);
  for (size_t v = 0; v < relative.values.size(); ++v) {
    if (grid.Ijk(v).x() >= marrow_mm) relative.values[v] = 0.2f;
  }
  return relative;
}

// Three voxels across the bar at each place.
std::vector<size_t> StrokesAt(const Grid& grid, const std::vector<int>& places_mm) {
  std::vector<size_t> strokes;
  for (const int i : places_mm) {
    for (int j = 0; j < 3; ++j) strokes.push_back(grid.Index(i, j, 1));
  }
  return strokes;
}

TEST(ReachFromStrokes, IsTheWayThroughTheMarrow) {
  const Volume bar = Bar(64);
  const Image<float> reach = ReachFromStrokes(bar, StrokesAt(bar.grid, {10}), kOptions, 1);
  EXPECT_NEAR(reach(10, 1, 1), 0, 1e-4);
  EXPECT_NEAR(reach(30, 1, 1), 20, 1e-4);
}

// 44 mm of marrow from the bright stroke, a fall of 0.8 for 100 mm each, less the noise, and 9 mm in the
// dark.
TEST(ReachFromStrokes, AStrokeInTheDarkLetsNothingIn) {
  const Volume bar = Bar(48);
  const Image<float> reach = ReachFromStrokes(bar, StrokesAt(bar.grid, {4, 57}), kOptions, 2);
  EXPECT_NEAR(reach(4, 1, 1), 0, 1e-4);
  EXPECT_NEAR(reach(57, 1, 1), 53 + 100 * (0.8 - 0.05), 0.1);
}

// With five groups the second best way counts: what one stroke alone is near to is not in the bone yet.
TEST(ReachFromStrokes, OneStrokeOfFiveDoesNotDecideAlone) {
  const Volume bar = Bar(64);
  const Image<float> five = ReachFromStrokes(bar, StrokesAt(bar.grid, {2, 12, 22, 32, 60}), kOptions, 5);
  EXPECT_NEAR(five(60, 1, 1), 28, 1e-4);
  EXPECT_NEAR(five(12, 1, 1), 10, 1e-4);
  const Image<float> four = ReachFromStrokes(bar, StrokesAt(bar.grid, {2, 12, 22, 60}), kOptions, 4);
  EXPECT_NEAR(four(60, 1, 1), 0, 1e-4) << "four are too few to outvote one";
}

// However many they are, all that reach each other are one compartment: of twelve the third best way counts.
TEST(ReachFromStrokes, ManyStrokesInOneBoneDecideTogether) {
  Grid grid;
  grid.size = {320, 3, 3};
  const Volume bar(grid, 1.0f);
  const std::vector<int> places{20, 45, 70, 95, 120, 145, 170, 195, 220, 245, 270, 295};
  const Image<float> reach = ReachFromStrokes(bar, StrokesAt(grid, places), kOptions, places.size());
  for (const int place : places) {
    const bool end = place == places.front() || place == places.back();
    EXPECT_NEAR(reach(place, 1, 1), end ? 50 : 25, 1e-4) << place;
  }
}

// Four bright ones; with the fifth the second best way would count.
TEST(ReachFromStrokes, StrokesInTheDarkHaveNoSay) {
  Volume bar = Bar(64);
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < 3; ++k) bar(35, j, k) = 0.74f;
  const Image<float> reach = ReachFromStrokes(bar, StrokesAt(bar.grid, {2, 12, 22, 32, 35}), kOptions, 5);
  EXPECT_NEAR(reach(12, 1, 1), 0, 1e-4);
}

}  // namespace
}  // namespace kvx
