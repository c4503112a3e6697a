// Distances against trying every voxel of the set.
#include "core/voxels/distance_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

TEST(SquaredDistanceMm, IsTheLeastOverAllVoxelsOfTheSet) {
  Mask set(testing_support::ObliqueGrid({9, 7, 6}));
  std::mt19937 random(3);
  for (uint8_t& in : set.values) in = random() % 20 == 0;
  const Image<double> squared = SquaredDistanceMm(set);
  const Volume distance = DistanceMapMm(set);
  const auto place = [&](size_t v) { return set.grid.ToMm(PointVox{set.grid.Ijk(v).cast<double>()}).lps; };
  for (size_t v = 0; v < set.values.size(); ++v) {
    double least = kNoVoxelInSight;
    for (size_t s = 0; s < set.values.size(); ++s) {
      if (set.values[s]) least = std::min(least, (place(v) - place(s)).squaredNorm());
    }
    ASSERT_NEAR(squared.values[v], least, 1e-9);
    ASSERT_NEAR(distance.values[v], std::sqrt(least), 1e-4);
  }
}

TEST(SquaredDistanceMm, IsTheSameWithinTheReach) {
  Mask set(testing_support::ObliqueGrid({11, 12, 9}));
  std::mt19937 random(5);
  for (uint8_t& in : set.values) in = random() % 90 == 0;
  const Image<double> squared = SquaredDistanceMm(set);
  const Volume distance = DistanceMapMm(set);
  for (const double reach_mm : {0.0, 1.5, std::sqrt(squared.values[17]), 4.0}) {
    const Image<double> squared_near = SquaredDistanceMm(set, reach_mm);
    const Volume near = DistanceMapMm(set, reach_mm);
    for (size_t v = 0; v < set.values.size(); ++v) {
      if (squared.values[v] <= reach_mm * reach_mm * (1 + 1e-9)) {
        EXPECT_EQ(squared_near.values[v], squared.values[v]);
        EXPECT_EQ(near.values[v], distance.values[v]);
      } else {
        EXPECT_GT(squared_near.values[v], reach_mm * reach_mm);
        EXPECT_GT(near.values[v], float(reach_mm));
      }
    }
  }
}

TEST(SquaredDistanceMm, OfAnEmptySetIsOutOfSight) {
  for (const double value : SquaredDistanceMm(Mask(testing_support::ObliqueGrid({3, 4, 5}))).values) {
    EXPECT_EQ(value, kNoVoxelInSight);
  }
}

TEST(DistanceMapMm, OfAnEmptySetIsFar) {
  for (const float value : DistanceMapMm(Mask(testing_support::ObliqueGrid({3, 4, 5}))).values)
    EXPECT_GT(value, 1e5f);
}

}  // namespace
}  // namespace kvx
