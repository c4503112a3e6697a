// Distances against trying every voxel of the set.
#include "core/distance_transform.h"

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
