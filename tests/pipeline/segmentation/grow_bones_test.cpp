// A small volume with known truth: two bones end to end, marrow in dark cortex, in fat as bright as marrow
// and muscle, under a bias field and noise.
#include "pipeline/segmentation/grow_bones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/errors.h"
#include "core/voxels/axes_order.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "pipeline/segmentation/strokes/expected_dice.h"
#include "tests/support/dice.h"
#include "tests/support/turned_grid.h"

namespace kvx {
namespace {

using testing_support::Dice;

constexpr double kCortexMm = 2.4;
const Eigen::Vector3d kSpacing(1.2, 1.2, 1.5);

struct World {
  Volume scan;
  LabelMap truth, strokes;
};

Grid GridOfWorld() {
  Grid grid;
  grid.size = {64, 36, 28};
  grid.spacing_mm = kSpacing;
  grid.origin = {{-20, 5, 11}};
  return grid;
}

// Signed distances (mm) of two ellipsoids whose ends are 2 mm apart, about.
double DistanceMm(const Eigen::Vector3d& mm, int bone) {
  const Eigen::Vector3d centre(bone == 1 ? 20.0 : 56.5, 21, 20), radii(17.2, 9, 9);
  const Eigen::Vector3d p = mm - centre;
  const double k = p.cwiseQuotient(radii).norm(), slope = p.cwiseQuotient(radii.cwiseAbs2()).norm();
  return slope > 0 ? k * (k - 1) / slope : -9;
}

// `thin`: whether cortex is thinner than a voxel on the side of the fat.
double Tissue(const Eigen::Vector3d& mm, bool thin) {
  const double d = std::min(DistanceMm(mm, 1), DistanceMm(mm, 2));
  const double cortex_mm = thin && mm.z() > 20 ? 0.6 : kCortexMm;
  if (d < -cortex_mm) return 1.0;
  if (d < 0) return 0.15;
  if (mm.y() < 6 || mm.y() > 36) return 0.0;  // air
  return mm.z() > 20 ? 0.98 : 0.5;            // fat above, muscle below
}

// `power`: of tissues' intensities, as another sequence shows them.
World MakeWorld(unsigned seed, bool thin = false, double power = 1) {
  const Grid grid = GridOfWorld();
  World world{Volume(grid), LabelMap(grid), LabelMap(grid)};
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 6);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Eigen::Vector3d centre = grid.Ijk(v).cast<double>().cwiseProduct(kSpacing);
    double sum = 0;
    for (int s = 0; s < 8; ++s) {
      const Eigen::Vector3d offset(s & 1 ? .25 : -.25, s & 2 ? .25 : -.25, s & 4 ? .25 : -.25);
      sum += std::pow(Tissue(centre + offset.cwiseProduct(kSpacing), thin), power) / 8;
    }
    const double bias = 1.6 - 0.014 * centre.x();  // a coil at one end: 1.6 to 0.5
    world.scan.values[v] = float(std::abs(160 * bias * sum + noise(random)));
    for (int bone : {1, 2}) {
      if (DistanceMm(centre, bone) < 0) world.truth.values[v] = uint16_t(bone);
    }
  }
  return world;
}

// Short straight lines inside each bone, and in the tissue around. Without one beyond `last_i` in a bone.
void DrawStrokes(World& world, unsigned seed, int last_i = 64) {
  std::mt19937 random(seed);
  const Grid& grid = world.scan.grid;
  for (const int label : {1, 2, 0}) {
    int drawn = 0;
    while (drawn < 12) {
      const Eigen::Vector3i from(int(random() % 64), int(random() % 36), int(random() % 28));
      const int axis = int(random() % 3), length = 5;
      bool inside = true;
      for (int n = 0; n < length; ++n) {
        const Eigen::Vector3i p = from + n * Eigen::Vector3i::Unit(axis);
        inside = inside && grid.Contains(p) && world.truth(p.x(), p.y(), p.z()) == label &&
                 (label == 0 || p.x() <= last_i);
      }
      for (int n = 0; inside && n < length; ++n) {
        const Eigen::Vector3i p = from + n * Eigen::Vector3i::Unit(axis);
        world.strokes(p.x(), p.y(), p.z()) = uint16_t(label == 0 ? 255 : label);
      }
      drawn += inside;
    }
  }
}

TEST(GrowBones, MarrowAndCortexOfTwoBonesUnderABiasField) {
  for (const unsigned seed : {1u, 2u}) {
    World world = MakeWorld(seed);
    DrawStrokes(world, seed);
    const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
    EXPECT_GT(Dice(grown.labels, world.truth, 1), 0.93) << "seed " << seed;
    EXPECT_GT(Dice(grown.labels, world.truth, 2), 0.93) << "seed " << seed;
  }
}

// As a T2-weighted sequence shows it: muscle is an eighth of marrow.
TEST(GrowBones, CortexIsToldFromMuscleNearlyAsDark) {
  for (const unsigned seed : {1u, 2u}) {
    World world = MakeWorld(seed, false, 3);
    DrawStrokes(world, seed);
    const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
    for (const int bone : {1, 2})
      EXPECT_GT(Dice(grown.labels, world.truth, bone), 0.93) << "seed " << seed << ", bone " << bone;
  }
}

TEST(GrowBones, SaysHowNearTheTruthABoneIsToBeExpected) {
  World world = MakeWorld(1);
  DrawStrokes(world, 1);
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
  ASSERT_EQ(grown.expected_dice.size(), 2u);
  for (const auto& [label, dice] : grown.expected_dice) EXPECT_NEAR(dice, 0.95, 0.05) << label;
  EXPECT_TRUE(grown.doubts.empty());
}

// Strokes in muscle, where nothing ends on cortex.
TEST(GrowBones, WhatIsNoBoneIsDoubted) {
  World world = MakeWorld(1);
  DrawStrokes(world, 1);
  for (int i = 28; i < 36; ++i) {
    for (int j = 24; j < 27; ++j) world.strokes(i, j, 6) = 3;
  }
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
  EXPECT_LT(grown.expected_dice.at(3), kSureDice);
  for (const int bone : {1, 2}) EXPECT_GT(grown.expected_dice.at(bone), grown.expected_dice.at(3) + 0.05);
  EXPECT_NE(std::ranges::find(grown.doubts, 3, &BoneDoubt::label), grown.doubts.end());
}

TEST(GrowBones, GreysMayBeShifted) {
  World world = MakeWorld(1);
  DrawStrokes(world, 1);
  for (const float shift : {-128.0f, 1000.0f}) {
    Volume shifted = world.scan;
    for (float& value : shifted.values) value += shift;
    const GrownBones grown = GrowBones(shifted, world.strokes, false, {});
    EXPECT_GT(Dice(grown.labels, world.truth, 1), 0.93) << shift;
    EXPECT_GT(Dice(grown.labels, world.truth, 2), 0.93) << shift;
  }
}

TEST(GrowBones, FatBehindThinCortexIsNoBone) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    World world = MakeWorld(seed, true);
    DrawStrokes(world, seed);
    const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
    EXPECT_GT(Dice(grown.labels, world.truth, 1), 0.88) << "seed " << seed;
  }
}

TEST(GrowBones, AnEndThatNoStrokeComesNearIsFound) {
  for (const unsigned seed : {1u, 3u}) {
    World world = MakeWorld(seed);
    DrawStrokes(world, seed, 46);  // in half of the second bone
    const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
    EXPECT_GT(Dice(grown.labels, world.truth, 1), 0.93) << "seed " << seed;
    EXPECT_GT(Dice(grown.labels, world.truth, 2), 0.9) << "seed " << seed;
  }
}

// A shaft in muscle that leaves the scan at its far side, without a stroke in its last third.
World MakeShaft() {
  constexpr int kLength = 64, kLastStroke = 40;
  Grid grid;
  grid.size = {26, 26, kLength};
  grid.spacing_mm = {2.5, 2.5, 2.5};
  World world{Volume(grid), LabelMap(grid), LabelMap(grid)};
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 5);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const double from_axis = std::hypot(p.x() - 12.5, p.y() - 12.5);  // voxels
    const bool bone = from_axis < 7 && p.z() > 5;
    const bool marrow = from_axis < 5 && p.z() > 7;
    world.truth.values[v] = bone;
    world.scan.values[v] = float(std::abs((marrow ? 160 : bone ? 20 : 80) + noise(random)));
    const bool marked = p.x() % 4 == 0 && p.y() % 4 == 1 && p.z() % 8 < 5;
    if (marked && p.z() <= kLastStroke && bone == marrow) world.strokes.values[v] = bone ? 1 : 255;
  }
  return world;
}

TEST(GrowBones, AShaftThatGoesOnFarFromItsStrokesIsFoundToTheEndOfTheScan) {
  const World world = MakeShaft();
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
  EXPECT_GT(Dice(grown.labels, world.truth, 1), 0.95);
}

// A dark band of three voxels along a bone: nothing but its thickness tells it from cortex.
TEST(GrowBones, ATendonAlongABoneIsNoCortex) {
  World world = MakeWorld(5);
  Mask tendon(world.scan.grid);
  for (size_t v = 0; v < tendon.values.size(); ++v) {
    const Eigen::Vector3d mm = world.scan.grid.Ijk(v).cast<double>().cwiseProduct(kSpacing);
    const double beyond_mm = DistanceMm(mm, 1);
    tendon.values[v] = beyond_mm >= 0 && beyond_mm < 4.5 && mm.z() < 16 && mm.x() > 8 && mm.x() < 30;
    if (tendon.values[v]) world.scan.values[v] *= 0.3f;
  }
  DrawStrokes(world, 5);
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
  double taken = 0, all = 0;
  for (size_t v = 0; v < tendon.values.size(); ++v) {
    all += tendon.values[v];
    taken += tendon.values[v] && grown.labels.values[v] == 1;
  }
  EXPECT_LT(taken, 0.5 * all);
  EXPECT_GT(Dice(grown.labels, world.truth, 1), 0.89);
}

TEST(GrowBones, IsTheSameTwiceAndKeepsEveryStroke) {
  World world = MakeWorld(3);
  DrawStrokes(world, 3);
  const GrownBones once = GrowBones(world.scan, world.strokes, false, {}),
                   twice = GrowBones(world.scan, world.strokes, false, {});
  EXPECT_EQ(once.labels.values, twice.labels.values);
  for (size_t v = 0; v < world.strokes.values.size(); ++v) {
    const int stroke = world.strokes.values[v];
    if (stroke != 0) {
      EXPECT_EQ(once.labels.values[v], stroke == 255 ? 0 : stroke);
    }
  }
}

auto IsDoubt(int label, const char* text) { return testing::FieldsAre(label, testing::HasSubstr(text)); }

// Eight voxels in the middle of the first bone.
void MarkBackgroundDeepInABone(LabelMap& strokes) {
  for (int i = 14; i < 22; ++i) strokes(i, 17, 13) = 255;
}

size_t BackgroundGivenToBones(const LabelMap& labels, const LabelMap& strokes) {
  size_t given = 0;
  for (size_t v = 0; v < labels.values.size(); ++v)
    given += strokes.values[v] == 255 && labels.values[v] != 0;
  return given;
}

TEST(GrowBones, WhatIsMarkedAsBackgroundIsInNoBone) {
  for (const unsigned seed : {1u, 2u}) {
    World world = MakeWorld(seed);
    DrawStrokes(world, seed);
    const GrownBones before = GrowBones(world.scan, world.strokes, false, {});
    MarkBackgroundDeepInABone(world.strokes);
    const GrownBones afresh = GrowBones(world.scan, world.strokes, false, {}),
                     after = GrowBones(world.scan, world.strokes, false, {}, &before.labels);
    EXPECT_EQ(BackgroundGivenToBones(afresh.labels, world.strokes), 0u) << "seed " << seed;
    EXPECT_THAT(afresh.doubts, testing::Contains(IsDoubt(1, "lie inside what was found")));
    EXPECT_EQ(BackgroundGivenToBones(after.labels, world.strokes), 0u) << "seed " << seed;
    const GrownBones again = GrowBones(world.scan, world.strokes, false, {}, &after.labels);
    EXPECT_EQ(again.labels.values, after.labels.values) << "no stroke contradicts them any more";
  }
}

TEST(GrowBones, DoNotDependOnTheOrderInWhichVoxelsAreStored) {
  World world = MakeWorld(2);
  DrawStrokes(world, 2);
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {});
  for (const size_t turn : {0, 3, 5}) {
    const Grid grid = testing_support::Turned(world.scan.grid, testing_support::kTurns[turn]);
    const LabelMap stored =
        GrowBones(InOrderOf(grid, world.scan), InOrderOf(grid, world.strokes), false, {}).labels;
    EXPECT_TRUE(stored.grid == grid);
    const LabelMap labels = InOrderOf(world.scan.grid, stored);
    size_t bone = 0, differ = 0;
    for (size_t v = 0; v < labels.values.size(); ++v) {
      bone += grown.labels.values[v] != 0;
      differ += labels.values[v] != grown.labels.values[v];
    }
    EXPECT_LE(double(differ), 1e-3 * double(bone)) << "turn " << turn;
  }
}

// Marks one voxel of `label` where the labels say otherwise; true when there is such a voxel.
bool Correct(const LabelMap& labels, const LabelMap& truth, int label, LabelMap& strokes) {
  for (size_t v = 0; v < truth.values.size(); ++v) {
    if (truth.values[v] != label || labels.values[v] == label || strokes.values[v] != 0) continue;
    strokes.values[v] = uint16_t(label);
    return true;
  }
  return false;
}

TEST(GrowBones, ABoneThatNoNewStrokeContradictsKeepsItsVoxels) {
  World world = MakeWorld(4);
  DrawStrokes(world, 4);
  const GrownBones before = GrowBones(world.scan, world.strokes, false, {});
  const GrownBones same = GrowBones(world.scan, world.strokes, false, {}, &before.labels);
  EXPECT_EQ(same.labels.values, before.labels.values);
  ASSERT_TRUE(Correct(before.labels, world.truth, 2, world.strokes));
  const GrownBones after = GrowBones(world.scan, world.strokes, false, {}, &before.labels),
                   afresh = GrowBones(world.scan, world.strokes, false, {});
  size_t first_changed = 0;
  for (size_t v = 0; v < world.truth.values.size(); ++v) {
    first_changed += (before.labels.values[v] == 1) != (after.labels.values[v] == 1);
    if (world.strokes.values[v] == 2) {
      EXPECT_EQ(after.labels.values[v], 2);
    }
  }
  EXPECT_EQ(first_changed, 0u);
  EXPECT_GT(Dice(after.labels, afresh.labels, 2), 0.97);
}

TEST(GrowBones, ABoneWithoutStrokesKeepsItsPreviousLabels) {
  World world = MakeWorld(5);
  DrawStrokes(world, 5);
  LabelMap previous = world.truth;
  for (size_t v = 0; v < previous.values.size(); ++v) {
    if (previous.values[v] == 2) previous.values[v] = 0;
    if (world.strokes.values[v] == 1) world.strokes.values[v] = 0;
  }
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {}, &previous);
  EXPECT_EQ(Dice(grown.labels, world.truth, 1), 1.0);
  EXPECT_GT(Dice(grown.labels, world.truth, 2), 0.9);
}

// A correction drawn in the first bone, with or without the strokes of the second.
TEST(GrowBones, ABoneWithoutStrokesLosesOnlyWhatIsMarkedAsSomethingElse) {
  for (const bool alone : {true, false}) {
    World world = MakeWorld(5);
    DrawStrokes(world, 5);
    for (uint16_t& stroke : world.strokes.values) stroke = !alone && stroke == 2 ? 2 : 0;
    MarkBackgroundDeepInABone(world.strokes);
    const GrownBones grown = GrowBones(world.scan, world.strokes, false, {}, &world.truth);
    LabelMap wanted = world.truth;
    for (int i = 14; i < 22; ++i) wanted(i, 17, 13) = 0;
    EXPECT_EQ(grown.labels.values, wanted.values) << alone;
    EXPECT_THAT(grown.doubts, testing::ElementsAre(IsDoubt(1, "its own strokes"))) << alone;
  }
}

TEST(GrowBones, ABoneMarkedInAnotherWithoutStrokesTakesWhatIsMarked) {
  World world = MakeWorld(5);
  for (int i = 14; i < 22; ++i) world.strokes(i, 17, 13) = 2;
  const GrownBones grown = GrowBones(world.scan, world.strokes, false, {}, &world.truth);
  size_t first = 0, before = 0;
  for (size_t v = 0; v < world.truth.values.size(); ++v) {
    first += grown.labels.values[v] == 1, before += world.truth.values[v] == 1;
    if (world.strokes.values[v] == 2) {
      EXPECT_EQ(grown.labels.values[v], 2);
    }
  }
  EXPECT_EQ(first, before - 8);
}

// Five balls in muscle, of which the last has a shell that is hardly darker than marrow.
TEST(GrowBones, ABoneWithFarLessCortexThanOthersIsDoubted) {
  const std::vector<Eigen::Vector3d> centres{
      {14, 14, 15}, {36, 14, 15}, {58, 14, 15}, {14, 42, 15}, {36, 42, 15}};
  Grid grid;
  grid.size = {60, 48, 20}, grid.spacing_mm = kSpacing;
  Volume scan(grid);
  LabelMap strokes(grid);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 4);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d mm = grid.Ijk(v).cast<double>().cwiseProduct(kSpacing);
    double grey = 120;
    if (std::abs(mm.y() - 28) < 1) strokes.values[v] = kBackgroundStroke;
    for (size_t b = 0; b < centres.size(); ++b) {
      const double inside = 9 - (mm - centres[b]).norm();
      if (inside <= 0) continue;
      grey = inside > kCortexMm ? 160 : b == 4 ? 95 : 25;
      const Eigen::Vector3d off = (mm - centres[b]).cwiseAbs();
      if (off.maxCoeff() < 4 && (off.array() < 0.8).count() >= 2) strokes.values[v] = uint16_t(b + 1);
    }
    scan.values[v] = float(grey + noise(random));
  }
  const GrownBones grown = GrowBones(scan, strokes, false, {});
  EXPECT_THAT(grown.doubts, testing::ElementsAre(IsDoubt(5, "far less dark cortex")));
}

TEST(GrowBones, NeedsAStrokeInABone) {
  World world = MakeWorld(1);
  world.strokes(3, 3, 3) = 255;
  EXPECT_THROW(GrowBones(world.scan, world.strokes, false, {}), InputError);
  const LabelMap none(world.scan.grid);
  EXPECT_THROW(GrowBones(world.scan, world.strokes, false, {}, &none), InputError) << "no bone to go on from";
}

}  // namespace
}  // namespace kvx
