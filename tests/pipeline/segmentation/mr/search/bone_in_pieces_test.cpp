// A block of three balls of marrow in dark walls, in fat; strokes mark two of them.
#include "pipeline/segmentation/mr/search/bone_in_pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "pipeline/segmentation/grow_bones.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

using Place = Eigen::Vector3d;

constexpr double kRadiusMm = 6.5, kWallMm = 2.4, kMarrow = 160, kClearRise = 0.1;
const Place kSpacing(1.2, 1.2, 1.5);
const Place kFirst(18, 20, 18), kSecond(31.5, 20, 18), kThird(25, 31, 18), kFar(58, 44, 18);

Place PlaceOf(const Grid& grid, size_t v) { return grid.Ijk(v).cast<double>().cwiseProduct(kSpacing); }

double InsideOf(const Place& ball, const Place& mm) { return kRadiusMm - (mm - ball).norm(); }

struct World {
  Volume scan;
  LabelMap strokes, air, found;  // found: bone 1
};

double Grey(const Place& mm) {
  for (const Place& ball : {kFirst, kSecond, kThird, kFar}) {
    const double inside = InsideOf(ball, mm);
    if (inside > 0) return inside > kWallMm ? 160 : 30;
  }
  return 150;
}

// Crosses in the middle of the first two balls.
World MakeWorld() {
  Grid grid;
  grid.size = {60, 48, 26}, grid.spacing_mm = kSpacing;
  World world{Volume(grid), LabelMap(grid), LabelMap(grid), LabelMap(grid)};
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 5);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Place mm = PlaceOf(grid, v);
    double sum = 0;
    for (int s = 0; s < 8; ++s) {
      const Place offset(s & 1 ? .25 : -.25, s & 2 ? .25 : -.25, s & 4 ? .25 : -.25);
      sum += Grey(mm + offset.cwiseProduct(kSpacing)) / 8;
    }
    world.scan.values[v] = float(sum + noise(random));
    for (const Place& ball : {kFirst, kSecond}) {
      const Place off = (mm - ball).cwiseAbs();
      world.strokes.values[v] |= off.maxCoeff() < 3 && (off.array() < 0.8).count() >= 2;
      world.found.values[v] |= InsideOf(ball, mm) > 0;
    }
  }
  return world;
}

template <class Inside>
void Set(LabelMap& labels, int value, Inside&& inside) {
  for (size_t v = 0; v < labels.values.size(); ++v)
    if (inside(PlaceOf(labels.grid, v))) labels.values[v] = uint16_t(value);
}

FoundBone BoneOf(const World& world) {
  const VoxelBox box{Eigen::Vector3i::Zero(), world.scan.grid.size};
  FoundBone bone{
      1, box, Mask(world.scan.grid), Image<float>(world.scan.grid, 1), false, Mask(world.scan.grid)};
  for (size_t v = 0; v < bone.mask.values.size(); ++v) {
    bone.mask.values[v] = bone.marrow.values[v] = world.found.values[v] == 1;
    if (world.strokes.values[v] == 1) bone.lean.values[v] = INFINITY;
  }
  return bone;
}

BoneInPieces InPieces(const World& world) {
  return AnswersInPieces({world.scan, world.scan, world.strokes, world.air}, BoneOf(world), world.found,
                         kMarrow, kClearRise);
}

// Of the voxels well inside.
double ShareOf(const Place& ball, const FoundBone& bone) {
  double voxels = 0, found = 0;
  for (size_t v = 0; v < bone.mask.values.size(); ++v) {
    if (InsideOf(ball, PlaceOf(bone.mask.grid, v)) < 1) continue;
    ++voxels, found += bone.mask.values[v];
  }
  return found / voxels;
}

size_t Voxels(const Mask& mask) { return size_t(std::ranges::count(mask.values, uint8_t(1))); }

TEST(BoneInPieces, APieceWithoutAStrokeBesideTheOthersIsFound) {
  const World world = MakeWorld();
  const BoneInPieces in_pieces = InPieces(world);
  ASSERT_EQ(in_pieces.answers.size(), 2u);
  EXPECT_EQ(in_pieces.unmarked, 1);
  for (const FoundBone& answer : in_pieces.answers) {
    EXPECT_EQ(answer.label, 1);
    for (const Place& ball : {kFirst, kSecond, kThird}) EXPECT_GT(ShareOf(ball, answer), 0.95);
    EXPECT_EQ(ShareOf(kFar, answer), 0);
    EXPECT_LT(double(Voxels(answer.mask)), 1.65 * double(Voxels(BoneOf(world).mask)));  // three for two
  }
}

TEST(BoneInPieces, WhatIsMarkedOtherwiseIsNone) {
  for (const int other : {2, int(kBackgroundStroke)}) {
    World world = MakeWorld();
    Set(world.strokes, other, [](const Place& mm) { return InsideOf(kThird, mm) > kRadiusMm - 1.5; });
    const BoneInPieces in_pieces = InPieces(world);
    EXPECT_EQ(in_pieces.unmarked, 0) << other;
    for (const FoundBone& answer : in_pieces.answers) EXPECT_LT(ShareOf(kThird, answer), 0.1) << other;
  }
}

TEST(BoneInPieces, WhatWasFoundOfAnotherBoneStaysThere) {
  World world = MakeWorld();
  Set(world.found, 2, [](const Place& mm) { return InsideOf(kThird, mm) > 0; });
  const BoneInPieces in_pieces = InPieces(world);
  EXPECT_EQ(in_pieces.unmarked, 0);
  for (const FoundBone& answer : in_pieces.answers) EXPECT_LT(ShareOf(kThird, answer), 0.1);
}

TEST(BoneInPieces, ABoneWhoseStrokesNoWallPartsIsOne) {
  World world = MakeWorld();
  for (LabelMap* labels : {&world.strokes, &world.found})
    Set(*labels, 0, [](const Place& mm) { return InsideOf(kSecond, mm) > 0; });
  EXPECT_TRUE(InPieces(world).answers.empty());
}

TEST(BoneInPieces, OfPiecesThatNoStrokeMarksAWordIsSaid) {
  World world = MakeWorld();
  Set(world.strokes, kBackgroundStroke, [](const Place& mm) {
    return (mm - Place(mm.x(), 8, 8)).norm() < 1.5 || (mm - Place(mm.x(), 50, 28)).norm() < 1.5;
  });
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, Progress{});
  const Eigen::Vector3i third = kThird.cwiseQuotient(kSpacing).array().round().cast<int>();
  EXPECT_EQ(grown.labels(third.x(), third.y(), third.z()), 1);
  EXPECT_THAT(Worded(grown.doubts, {}), testing::Contains(testing::HasSubstr("bone 1: it is in pieces")));
}

// The second answer drops what lies between the pieces.
TEST(BoneInPieces, WhatLeakedOutBetweenThePiecesGoes) {
  World world = MakeWorld();
  const auto leak = [](const Place& mm) {
    return mm.x() > 10 && mm.x() < 38 && mm.y() > 5 && mm.y() < 12 && mm.z() > 9 && mm.z() < 27;
  };
  Set(world.found, 1, leak);
  const auto leaked = [&](const FoundBone& bone) {
    size_t voxels = 0;
    for (size_t v = 0; v < bone.mask.values.size(); ++v)
      voxels += bone.mask.values[v] && leak(PlaceOf(bone.mask.grid, v));
    return voxels;
  };
  const BoneInPieces in_pieces = InPieces(world);
  ASSERT_EQ(in_pieces.answers.size(), 2u);
  EXPECT_GT(leaked(in_pieces.answers[0]), 1000u);
  EXPECT_LT(leaked(in_pieces.answers[1]), 50u);
  for (const Place& ball : {kFirst, kSecond, kThird}) EXPECT_GT(ShareOf(ball, in_pieces.answers[1]), 0.95);
}

// What strokes mark is kept though no wall closes it.
TEST(BoneInPieces, AMarkedPartThatIsNoBlobStays) {
  World world = MakeWorld();
  const auto slab = [](const Place& mm) {
    return mm.x() > 10 && mm.x() < 38 && mm.y() > 5 && mm.y() < 12 && mm.z() > 9 && mm.z() < 27;
  };
  Set(world.found, 1, slab);
  Set(world.strokes, 1,
      [](const Place& mm) { return mm.x() > 14 && mm.x() < 34 && (mm - Place(mm.x(), 9, 18)).norm() < 1.5; });
  const BoneInPieces in_pieces = InPieces(world);
  ASSERT_EQ(in_pieces.answers.size(), 2u);
  size_t kept = 0;
  for (size_t v = 0; v < world.found.values.size(); ++v)
    kept += in_pieces.answers[1].mask.values[v] && slab(PlaceOf(world.found.grid, v));
  EXPECT_GT(kept, 1000u);
}

TEST(BoneInPieces, ABoneOfWhichNothingWasFoundHasNoAnswer) {
  World world = MakeWorld();
  Set(world.found, 0, [](const Place&) { return true; });
  EXPECT_TRUE(InPieces(world).answers.empty());
}

}  // namespace
}  // namespace kvx
