// A slab of tissue in air, its sides anywhere in their voxels, every voxel the mean over itself.
#include "pipeline/segmentation/mr/air_share.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kvx {
namespace {

constexpr double kTissue = 150;
const Eigen::Vector3i kSize(30, 9, 7);

// Sides in voxels along i; voxel 3 is from 2.5 to 3.5.
Volume Slab(double low, double high) {
  Grid grid;
  grid.size = kSize;
  grid.spacing_mm = {1.5, 1.5, 2.0};
  Volume scan(grid);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const double i = grid.Ijk(v).x();
    const double inside = std::min(high, i + 0.5) - std::max(low, i - 0.5);
    scan.values[v] = float(kTissue * std::clamp(inside, 0.0, 1.0));
  }
  return scan;
}

LabelMap SureAir(const Volume& scan) {
  LabelMap air(scan.grid);
  for (size_t v = 0; v < air.values.size(); ++v) air.values[v] = scan.values[v] < 0.1 * kTissue;
  return air;
}

TEST(AirShares, SidesAreKnownToAFifthOfAVoxel) {
  for (const double side : {0.0, 0.3, 0.5, 0.7}) {
    const double low = 6 + side, high = 21 - 0.5 * side;
    const Volume scan = Slab(low, high), shares = AirShares(scan, SureAir(scan));
    double before = 0, behind = 0;
    for (int i = 0; i < kSize.x(); ++i) (i < 14 ? before : behind) += shares(i, 4, 3);
    EXPECT_NEAR(before - 0.5, low, 0.21) << side;  // the grid begins half a voxel before its first centre
    EXPECT_NEAR(kSize.x() - 0.5 - behind, high, 0.21) << side;
    EXPECT_EQ(shares(3, 4, 3), 1);
    EXPECT_EQ(shares(9, 4, 3), 0);
  }
}

TEST(AirShares, DarkPlacesDeepInTheBodyAreNoAir) {
  Volume scan = Slab(5, 25);
  const LabelMap air = SureAir(scan);
  scan(15, 4, 3) = 0;
  EXPECT_EQ(AirShares(scan, air)(15, 4, 3), 0);
}

TEST(AirShares, NothingIsAirWhereNoneIsSure) {
  const Volume shares = AirShares(Slab(5, 25), LabelMap(Slab(5, 25).grid));
  EXPECT_EQ(*std::ranges::max_element(shares.values), 0);
}

}  // namespace
}  // namespace kvx
