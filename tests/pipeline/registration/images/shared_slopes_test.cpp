// Waves, ramps and noise whose slopes are known on paper.
#include "pipeline/registration/images/shared_slopes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/support/in_place.h"

namespace kvx {
namespace {

using testing_support::InPlace;
using Greys = std::function<double(const Eigen::Vector3d& ijk)>;

constexpr float kWeight = 0.5f;
constexpr double kSpacing = 2;

BlockLevel LevelOf(const Greys& of_template, const Greys& of_scan) {
  BlockLevel level;
  level.grid.size = {24, 24, 24};
  level.grid.spacing_mm = {kSpacing, kSpacing, kSpacing};
  level.weight.assign(level.grid.VoxelCount(), kWeight);
  level.scan = Volume(level.grid);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Vector3d ijk = level.grid.Ijk(v).cast<double>();
    level.intensity.push_back(float(of_template(ijk)));
    level.scan.values[v] = float(of_scan(ijk));
  }
  return level;
}

// Of the block in the middle, whose 8 x 8 x 8 voxels all have neighbours.
SharedSlopes Middle(const BlockLevel& level) {
  const Image<SharedSlopes> blocks = SharedSlopesOfBlocks(level, InPlace(level.grid));
  EXPECT_EQ(blocks.grid.size, Eigen::Vector3i(3, 3, 3));
  return blocks(1, 1, 1);
}

// A wave of eight voxels along the first axis: central differences of it are sin(pi/4) cos(pi i/4) per voxel,
// whose squares are a half on average.
double Wave(const Eigen::Vector3d& ijk) { return std::sin(std::numbers::pi / 4 * ijk.x()); }

TEST(SharedSlopes, OfAWaveInBothTellOfItsAxisAlone) {
  const Eigen::Matrix3d information =
      Middle(LevelOf(Wave, [](const auto& p) { return 3 * Wave(p); })).Information();
  const double step = std::sin(std::numbers::pi / 4) / kSpacing;
  EXPECT_NEAR(information(0, 0), kWeight * 512 * 3 * step * step / 2, 1e-3);
  Eigen::Matrix3d others = information;
  others(0, 0) = 0;
  EXPECT_LT(others.norm(), 1e-4);
}

TEST(SharedSlopes, OfAWaveThatIsTurnedRoundAreNone) {
  EXPECT_LT(Middle(LevelOf(Wave, [](const auto& p) { return -Wave(p); })).Information()(0, 0), 0);
}

// As a coil makes them.
TEST(SharedSlopes, ThatAreTheSameEverywhereTellNothing) {
  const auto ramp = [](const Eigen::Vector3d& p) { return 5 * p.x() - 3 * p.z(); };
  const SharedSlopes sum = Middle(LevelOf(ramp, ramp));
  EXPECT_NEAR(sum.products(0, 2), kWeight * 512 * 5 * -3 / (kSpacing * kSpacing), 1e-2);
  EXPECT_NEAR(sum.weight, kWeight * 512, 1e-9);
  EXPECT_LT(sum.Information().norm(), 1e-6 * sum.products.norm());
}

// Noise of its own in either image has slopes enough, but none in common: over n voxels their products have a
// mean of nought and a spread of the square over the root of n, a neighbour's share and all.
TEST(SharedSlopes, OfNoiseAreNone) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  const auto grey = [&](const auto&) { return noise(random); };
  const BlockLevel level = LevelOf(grey, grey);
  const Image<SharedSlopes> blocks = SharedSlopesOfBlocks(level, InPlace(level.grid));
  SharedSlopes sum;
  for (const SharedSlopes& block : blocks.values) sum += block;
  const double voxels = sum.weight / kWeight, square = 0.5 / (kSpacing * kSpacing);
  EXPECT_GT(voxels, 22 * 22 * 22 - 1);
  EXPECT_LT(sum.Information().cwiseAbs().maxCoeff(), 6 * kWeight * square * std::sqrt(voxels));
}

TEST(SharedSlopes, AreOfVoxelsThatTheScanShowsAndThatCount) {
  BlockLevel level = LevelOf(Wave, Wave);
  std::vector<Eigen::Vector3f> places_mm = InPlace(level.grid);
  for (size_t v = 0; v < places_mm.size(); ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    if (p.z() >= 12) places_mm[v].x() += 1000;  // so the last slope is that of 10
    if (p.y() < 12) level.weight[v] = 0;        // and the first that of 13, beside which both count
  }
  const Image<SharedSlopes> blocks = SharedSlopesOfBlocks(level, places_mm);
  EXPECT_NEAR(blocks(1, 1, 1).weight, kWeight * 8 * 3 * 3, 1e-9);
  EXPECT_EQ(blocks(1, 1, 2).weight, 0);
  EXPECT_EQ(blocks(1, 0, 1).weight, 0);
  EXPECT_EQ(SharedSlopes().Information(), Eigen::Matrix3d::Zero());
}

}  // namespace
}  // namespace kvx
