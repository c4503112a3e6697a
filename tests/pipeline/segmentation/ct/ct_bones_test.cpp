// Hollow balls in CT whose marrow looks like the tissue around them: only their shells tell where they end.
#include "pipeline/segmentation/ct/ct_bones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "pipeline/segmentation/ct/ct_outside.h"
#include "pipeline/segmentation/grow_bones.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "tests/support/dice.h"

namespace kvx {
namespace {

using testing_support::Dice;

constexpr double kShellMm = 2.5;

Grid BodyGrid() {
  Grid grid;
  grid.size = {56, 44, 30};
  grid.spacing_mm = {1.0, 1.1, 1.4};
  grid.origin = {{7, -12, 30}};
  return grid;
}

Eigen::Vector3d PlaceMm(const Grid& grid, size_t v) {
  return grid.Ijk(v).cast<double>().cwiseProduct(grid.spacing_mm);
}

// Signed distance from two balls of 10 mm radius that are 1.5 mm apart.
double ToBallMm(const Eigen::Vector3d& mm, int ball) {
  return (mm - Eigen::Vector3d(ball == 1 ? 17.0 : 38.5, 24, 20)).norm() - 10;
}

struct Body {
  Volume scan;
  LabelMap truth, strokes;
};

// Air on the two sides of the body; muscle of 50 HU; shells of 500 HU; marrow of `marrow_hu`; noise.
Body MakeBody(float marrow_hu, double noise_hu) {
  const Grid grid = BodyGrid();
  Body body{Volume(grid), LabelMap(grid), LabelMap(grid)};
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, noise_hu);
  for (size_t v = 0; v < body.scan.values.size(); ++v) {
    const Eigen::Vector3d mm = PlaceMm(grid, v);
    const double d = std::min(ToBallMm(mm, 1), ToBallMm(mm, 2));
    const float hu = mm.y() < 3 || mm.y() > 45 ? -1000.0f
                     : d > 0                   ? 50.0f
                     : d > -kShellMm           ? 500.0f
                                               : marrow_hu;
    body.scan.values[v] = hu + float(noise(random));
    if (d < 0) body.truth.values[v] = ToBallMm(mm, 1) < 0 ? 1 : 2;
  }
  return body;
}

// A line through the middle of each ball's marrow, and one in the muscle beside them.
void DrawStrokes(Body& body) {
  for (int i = 12; i < 22; ++i) body.strokes(i, 22, 14) = 1;
  for (int i = 34; i < 43; ++i) body.strokes(i, 22, 14) = 2;
  for (int i = 4; i < 50; ++i) body.strokes(i, 36, 2) = uint16_t(kBackgroundStroke);
}

TEST(CtBones, ShellsBoundMarrowThatLooksLikeMuscleOrFat) {
  for (const float marrow_hu : {50.0f, -60.0f, 130.0f}) {
    Body body = MakeBody(marrow_hu, 20);
    DrawStrokes(body);
    const GrownBones grown = GrowBones(body.scan, body.strokes, true, {});
    EXPECT_GT(Dice(grown.labels, body.truth, 1), 0.97) << marrow_hu;
    EXPECT_GT(Dice(grown.labels, body.truth, 2), 0.97) << marrow_hu;
    EXPECT_TRUE(grown.doubts.empty());
    EXPECT_TRUE(grown.expected_dice.empty()) << "known of MR alone";
  }
}

TEST(CtBones, AreTheSameTwiceUnderStrongNoise) {
  Body body = MakeBody(0, 50);
  DrawStrokes(body);
  const GrownBones once = GrowBones(body.scan, body.strokes, true, {}),
                   twice = GrowBones(body.scan, body.strokes, true, {});
  EXPECT_EQ(once.labels.values, twice.labels.values);
  EXPECT_GT(Dice(once.labels, body.truth, 1), 0.9);
}

// In the shell and in the marrow.
TEST(CtBones, WhatIsMarkedAsBackgroundIsInNone) {
  Body body = MakeBody(50, 20);
  DrawStrokes(body);
  const GrownBones before = GrowBones(body.scan, body.strokes, true, {});
  for (int i = 11; i < 23; ++i) body.strokes(i, 22, 17) = uint16_t(kBackgroundStroke);
  for (int k = 10; k < 18; ++k) body.strokes(8, 22, k) = uint16_t(kBackgroundStroke);
  for (const LabelMap* previous : {static_cast<const LabelMap*>(nullptr), &before.labels}) {
    const GrownBones grown = GrowBones(body.scan, body.strokes, true, {}, previous);
    size_t given = 0;
    for (size_t v = 0; v < body.strokes.values.size(); ++v)
      given += body.strokes.values[v] == kBackgroundStroke && grown.labels.values[v] != 0;
    EXPECT_EQ(given, 0u) << (previous ? "after" : "afresh");
    EXPECT_THAT(grown.doubts, testing::ElementsAre(testing::FieldsAre(
                                  1, testing::HasSubstr("of the background or of another bone lie inside"))));
  }
}

// In muscle, far from the ball: a lump of muscle is found around them.
TEST(CtBones, StrokesOutsideOfTheirBoneAreToldOf) {
  Body body = MakeBody(50, 20);
  DrawStrokes(body);
  for (int i = 4; i < 10; ++i) body.strokes(i, 22, 26) = 2;
  const GrownBones grown = GrowBones(body.scan, body.strokes, true, {});
  EXPECT_THAT(grown.doubts,
              testing::ElementsAre(testing::FieldsAre(2, testing::HasSubstr("pieces that do not touch"))));
}

TEST(OutsideOfBones, RollsAroundAShellWithAGap) {
  Body body = MakeBody(50, 0);
  for (size_t v = 0; v < body.scan.values.size(); ++v) {  // a hole of 5 mm in the first ball's shell
    const Eigen::Vector3d mm = PlaceMm(body.scan.grid, v) - Eigen::Vector3d(17, 24, 20);
    if (mm.y() > 0 && mm.head<1>().norm() < 2.5 && std::abs(mm.z()) < 2.5) body.scan.values[v] = 50;
  }
  const Mask outside = OutsideOfBones(body.scan);
  size_t far = 0, found = 0;
  for (size_t v = 0; v < outside.values.size(); ++v) {
    const Eigen::Vector3d mm = PlaceMm(body.scan.grid, v);
    const double d = std::min(ToBallMm(mm, 1), ToBallMm(mm, 2));
    EXPECT_FALSE(outside.values[v] && d < 4) << "at " << mm.transpose();
    far += d > 9.5, found += d > 9.5 && outside.values[v];
  }
  EXPECT_EQ(found, far);
}

TEST(OutsideOfBones, SaysNothingWithoutAir) {
  const Mask outside = OutsideOfBones(Volume(BodyGrid(), 40.0f));
  EXPECT_EQ(std::count(outside.values.begin(), outside.values.end(), 1), 0);
}

}  // namespace
}  // namespace kvx
