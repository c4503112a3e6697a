// Balls whose places and sizes are known; the middle of their neck is a plane.
#include "pipeline/segmentation/ct/threshold_bones.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/errors.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

Grid SmallGrid() {
  Grid grid;
  grid.size = {60, 30, 26};
  grid.spacing_mm = {0.8, 1.0, 1.2};
  return grid;
}

double ToCentreMm(const Grid& grid, size_t v, double x_mm) {
  return (grid.Ijk(v).cast<double>().cwiseProduct(grid.spacing_mm) - Eigen::Vector3d(x_mm, 15, 15)).norm();
}

// Two balls of 9 and 8 mm that overlap by 2 mm: cortex 900 HU, marrow of fat inside (-60 HU), soft tissue 40
// HU.
Volume TouchingBalls() {
  Volume scan(SmallGrid(), 40.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const double d = std::min(ToCentreMm(scan.grid, v, 14) - 9, ToCentreMm(scan.grid, v, 29) - 8);
    if (d < 0) scan.values[v] = d < -3 ? -60.0f : 900.0f;
  }
  return scan;
}

TEST(ThresholdBones, PartsTouchingBallsAndFillsTheirMarrow) {
  const Volume scan = TouchingBalls();
  const double level = FindBoneLevel(scan);
  EXPECT_GT(level, 40);
  EXPECT_LT(level, 900);
  const LabelMap labels = ThresholdBones(scan, LevelsOf(scan, level)).labels;
  EXPECT_EQ(std::set<uint16_t>(labels.values.begin(), labels.values.end()), (std::set<uint16_t>{0, 1, 2}));
  size_t wrong = 0, all = 0;
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const double first = ToCentreMm(scan.grid, v, 14) - 9, second = ToCentreMm(scan.grid, v, 29) - 8;
    const int truth = std::min(first, second) >= 0 ? 0 : first <= second ? 1 : 2;
    all += truth != 0;
    wrong += labels.values[v] != truth;
  }
  EXPECT_LT(double(wrong), 0.03 * double(all));
}

// A ball of 900 HU in soft tissue of 40 HU, blurred over 1.5 mm either way: half way up is 470 HU. The
// level is a little lower, since the surface is looked for around Otsu's threshold.
TEST(FindBoneLevel, LiesAboutHalfWayUpABlurredSurface) {
  Volume scan(SmallGrid());
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const double outside = ToCentreMm(scan.grid, v, 24) - 9;
    scan.values[v] = float(40 + 860 * std::clamp(0.5 - outside / 3, 0.0, 1.0));
  }
  EXPECT_NEAR(FindBoneLevel(scan), 440, 40);
}

// How far the level goes when the voxels that `where` names are given another value.
template <class Where>
double Drawn(const Where& where, float value) {
  Volume scan = TouchingBalls();
  const double level = FindBoneLevel(scan);
  for (size_t v = 0; v < scan.values.size(); ++v)
    if (where(scan.grid.Ijk(v))) scan.values[v] = value;
  return FindBoneLevel(scan) - level;
}

TEST(FindBoneLevel, IsNotDrawnOutByAir) {
  EXPECT_NEAR(Drawn([](const Eigen::Vector3i& p) { return p.y() < 4; }, -1000), 0, 60);
}

// Air that cuts through the bone itself, as at the surface of a specimen.
TEST(FindBoneLevel, IsNotDrawnDownByAirAtTheBone) {
  EXPECT_NEAR(Drawn([](const Eigen::Vector3i& p) { return p.y() < 13; }, -1000), 0, 20);
}

// A pin in a ball, as bright as a scanner can say.
TEST(FindBoneLevel, IsNotDrawnUpByMetal) {
  const auto pin = [](const Eigen::Vector3i& p) {
    return p.y() / 2 == 7 && p.z() / 2 == 6 && p.x() >= 8 && p.x() < 22;
  };
  EXPECT_NEAR(Drawn(pin, 3000), 0, 20);
}

// Nineteen voxels of twenty are fat or muscle.
TEST(FindBoneLevel, IsNotThatOfMuscleInFat) {
  Volume scan(SmallGrid());
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const double bone = ToCentreMm(scan.grid, v, 24) - 7;
    scan.values[v] = bone < 0 ? 400.0f : scan.grid.Ijk(v).x() % 30 < 12 ? -100.0f : 50.0f;
  }
  const double level = FindBoneLevel(scan);
  EXPECT_GT(level, 100);
  EXPECT_LT(level, 400);
}

// The end of a long bone as CT shows it: cortex of 1.5 mm that the view cuts, marrow of fat, and at the end a
// mesh of rods 0.8 mm thick, 1.6 mm apart.
TEST(ThresholdBones, AHollowBoneWithASpongyEndIsOne) {
  const Grid grid = testing_support::Cubes({56, 56, 80}, 0.4);
  Volume scan(grid, 40.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const Eigen::Vector3d mm = p.cast<double>() * 0.4 - Eigen::Vector3d(11, 11, 21);
    const double to_surface = Eigen::Vector3d(mm.x(), mm.y(), std::max(mm.z(), 0.0)).norm() - 8;
    if (to_surface >= 0) continue;
    const int rods = (p.x() % 6 < 2) + (p.y() % 6 < 2) + (p.z() % 6 < 2);
    scan.values[v] = to_surface > -1.5 ? 1200.0f : mm.z() > -6 && rods > 1 ? 900.0f : -60.0f;
  }
  const LabelMap labels = ThresholdBones(scan, LevelsOf(scan, std::nullopt)).labels;
  EXPECT_EQ(std::set<uint16_t>(labels.values.begin(), labels.values.end()), (std::set<uint16_t>{0, 1}));
}

// A shaft of dense cortex whose ends are filled with spongy bone of 300 HU: at 200 HU they are solid and
// wider than the shaft, so necks would part them.
TEST(ThresholdBones, ALowLevelPartsBonesWhereTheDenserOneOfTheScanDoes) {
  const Grid grid = testing_support::Cubes({50, 50, 120}, 0.5);
  Volume scan(grid, 40.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d mm = grid.Ijk(v).cast<double>() * 0.5 - Eigen::Vector3d(12, 12, 30);
    const double along = std::abs(mm.z());
    if (along > 27) continue;
    const double radius_mm = 4 + 5 * std::clamp((along - 8) / 8, 0.0, 1.0);
    const double inside_mm = radius_mm - std::hypot(mm.x(), mm.y());
    if (inside_mm > 0) scan.values[v] = inside_mm < 1.5 ? 1200.0f : along > 12 ? 300.0f : -60.0f;
  }
  EXPECT_GT(LevelsOf(scan, 200).parting_hu, 400);
  EXPECT_EQ(LevelsOf(scan, 900).parting_hu, 900);
  const LabelMap labels = ThresholdBones(scan, LevelsOf(scan, 200)).labels;
  EXPECT_EQ(std::set<uint16_t>(labels.values.begin(), labels.values.end()), (std::set<uint16_t>{0, 1}));
  EXPECT_EQ(labels(24, 24, 104), 1) << "what the lower level adds is the bone's, too";
}

TEST(ThresholdBones, NothingAboveTheLevelIsSaidInWords) {
  EXPECT_THROW(ThresholdBones(Volume(SmallGrid(), 40.0f), {300, 300}), InputError);
}

}  // namespace
}  // namespace kvx
