// Corners that a program filled up are told from masked air, on limbs of known shape.
#include "pipeline/scans/filled_corners.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr double kLimbRadius = 9;

// A limb along the third axis of voxels in the noise of air.
Volume LimbInNoise() {
  Volume scan(ObliqueGrid({48, 48, 48}));
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 5);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    const bool limb = std::hypot(p.x() - 23.5, p.y() - 23.5) < kLimbRadius;
    scan.values[v] = std::hypot((limb ? 100 : 0) + noise(random), noise(random));
  }
  return scan;
}

// Voxels from the nearest face of a box that is turned by 30 degrees about the first axis; negative within.
double BeyondTurnedBox(const Eigen::Vector3i& p) {
  const Eigen::Vector3d q = Eigen::AngleAxisd(std::acos(std::sqrt(0.75)), Eigen::Vector3d::UnitX()) *
                            (p.cast<double>() - Eigen::Vector3d::Constant(23.5));
  return (q.cwiseAbs() - Eigen::Vector3d(30, 18, 18)).maxCoeff();
}

TEST(FilledCorners, AreFoundBesideTheNoiseOfAir) {
  Volume turned = LimbInNoise();
  const Grid& grid = turned.grid;
  for (size_t v = 0; v < turned.values.size(); ++v)
    if (BeyondTurnedBox(grid.Ijk(v)) > 0) turned.values[v] = 0;
  const Mask filled = FilledCorners(turned, "MR");
  ASSERT_EQ(filled.grid, grid);
  for (size_t v = 0; v < filled.values.size(); ++v) {
    const double beyond = BeyondTurnedBox(grid.Ijk(v));
    if (beyond > 0) {
      EXPECT_TRUE(filled.values[v]) << v;
    }
    if (beyond < -3.5) {
      EXPECT_FALSE(filled.values[v]) << v;
    }
  }
}

TEST(FilledCorners, MaskedAirIsNone) {
  Volume masked = LimbInNoise();
  for (size_t v = 0; v < masked.values.size(); ++v) {
    const Eigen::Vector3i p = masked.grid.Ijk(v);
    if (std::hypot(p.x() - 23.5, p.y() - 23.5) > kLimbRadius + 3) masked.values[v] = 0;
  }
  EXPECT_TRUE(FilledCorners(masked, "MR").values.empty());
  masked(5, 5, 24) = 32767;
  EXPECT_TRUE(FilledCorners(masked, "MR").values.empty()) << "nor where one of its voxels is bright";
}

TEST(FilledCorners, AScanOfNoiseAndAScanOfOneValueHaveNone) {
  EXPECT_TRUE(FilledCorners(LimbInNoise(), "MR").values.empty());
  EXPECT_TRUE(FilledCorners(Volume(ObliqueGrid({9, 9, 9}), 3), "").values.empty());
}

// A CT with air of one value, filled with another beyond a round field that the limb leaves.
TEST(FilledCorners, AreFoundBesideAirOfOneValueAndBecomeAir) {
  Volume round = LimbInNoise();
  const auto beyond = [&](const Eigen::Vector3i& p) { return std::hypot(p.x() - 23.5, p.z() - 23.5) - 20; };
  for (size_t v = 0; v < round.values.size(); ++v) {
    const Eigen::Vector3i p = round.grid.Ijk(v);
    const bool limb = std::hypot(p.x() - 23.5, p.y() - 23.5) < kLimbRadius;
    round.values[v] = beyond(p) > 0 ? -3024.0f : limb ? 40 + 0.1f * round.values[v] : -1024.0f;
  }
  const Mask filled = FilledCorners(round, "CT");
  ASSERT_FALSE(filled.values.empty());
  const Volume with_air = WithAirInCorners(round, "CT");
  for (size_t v = 0; v < round.values.size(); ++v) {
    const bool outside = beyond(round.grid.Ijk(v)) > 0;
    if (outside) {
      EXPECT_TRUE(filled.values[v]) << v;
    }
    EXPECT_EQ(with_air.values[v], outside ? -1024.0f : round.values[v]) << v;
  }
}

// The limb with the round view's outside filled, so narrow that the limb is cut and no air is left beside it.
Volume CutRound(Volume scan, float filling) {
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    if (std::hypot(p.x() - 23.5, p.y() - 23.5) > kLimbRadius - 2) scan.values[v] = filling;
  }
  return scan;
}

TEST(ImpossibleFilling, OfACtBecomesTheLeastOfAir) {
  Volume ct = LimbInNoise();
  for (size_t v = 0; v < ct.values.size(); ++v) ct.values[v] -= v % 7 ? 60 : 180;  // muscle and fat
  for (const char* modality : {"CT", ""}) {
    for (const float filling : {-3024.0f, -32768.0f}) {
      EXPECT_EQ(WithoutImpossibleFilling(CutRound(ct, filling), modality).values, CutRound(ct, -1024).values);
    }
    EXPECT_EQ(WithoutImpossibleFilling(CutRound(ct, -1000), modality).values, CutRound(ct, -1000).values);
  }
}

TEST(ImpossibleFilling, OfOtherScansBecomesDark) {
  const Volume dark = CutRound(LimbInNoise(), 0);
  EXPECT_EQ(WithoutImpossibleFilling(dark, "").values, dark.values);
  for (const float filling : {-1000.0f, -3024.0f, -32768.0f, 9999.0f}) {
    EXPECT_EQ(WithoutImpossibleFilling(CutRound(LimbInNoise(), filling), "").values, dark.values) << filling;
    EXPECT_EQ(WithoutImpossibleFilling(CutRound(LimbInNoise(), filling), "MR").values, dark.values)
        << filling;
  }
}

// Moved within its grid: four corners are filled, the others in air.
TEST(ImpossibleFilling, MayHaveSomeCornersOnly) {
  for (const float filling : {-1000.0f, 9999.0f}) {
    Volume moved = LimbInNoise(), dark = moved;
    for (int k = 0; k < 10; ++k) {
      for (int j = 0; j < 48; ++j)
        for (int i = 0; i < 48; ++i) moved(i, j, k) = filling, dark(i, j, k) = 0;
    }
    EXPECT_EQ(WithoutImpossibleFilling(moved, "").values, dark.values) << filling;
  }
}

}  // namespace
}  // namespace kvx
