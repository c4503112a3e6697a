// Wide voxels and thick slices, against functions that a cubic spline holds exactly or nearly so.
#include "pipeline/scans/finer_scan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

Grid GridOf(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm) {
  return testing_support::PlainGrid(size, spacing_mm, {3, -4, 5});
}

template <class Function>
Volume Filled(const Grid& grid, Function function) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v)
    out.values[v] = float(function(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps));
  return out;
}

TEST(FinerScan, ThickSlicesAreFilledSmoothly) {
  const auto wave = [](const Eigen::Vector3d& x) { return 100 + 30 * std::sin(x.z() / 5) + x.x(); };
  const Volume fine = AsFineAs(Filled(GridOf({6, 5, 20}, {1, 1, 4}), wave), 1);
  ASSERT_EQ(fine.grid.size, Eigen::Vector3i(6, 5, 77));
  EXPECT_NEAR(fine.grid.spacing_mm.z(), 1, 1e-12);
  const Volume truth = Filled(fine.grid, wave);
  for (int k = 12; k < 65; ++k) EXPECT_NEAR(fine(2, 3, k), truth(2, 3, k), 0.5) << k;
}

TEST(FinerScan, GoesThroughWhatTheScanShows) {
  const auto rough = [](const Eigen::Vector3d& x) {
    return 50 + 40 * std::sin(7 * x.x() + 3 * x.y() + x.z());
  };
  const Volume scan = Filled(GridOf({5, 6, 7}, {2, 3, 4}), rough);
  const Volume fine = AsFineAs(scan, 1);
  for (int k = 0; k < 7; ++k) EXPECT_EQ(fine(2 * 3, 3 * 4, 4 * k), scan(3, 4, k));
}

TEST(FinerScan, AScanThatIsAsFineStaysAsItIs) {
  const Volume scan(GridOf({4, 4, 4}, {1.4, 1.4, 0.5}), 7);
  EXPECT_EQ(AsFineAs(scan, 1).grid.size, scan.grid.size);
}

TEST(FinerScan, NoVoxelBecomesMoreThanFourAlongAnAxis) {
  EXPECT_EQ(AsFineAs(Volume(GridOf({3, 3, 3}, {1, 1, 20}), 7), 1).grid.size, Eigen::Vector3i(3, 3, 9));
}

// Splines need two.
TEST(CoarserScan, OfAFewPlanesTwoAreLeft) {
  EXPECT_EQ(AsCoarseAs(Volume(GridOf({1, 2, 4}, {0.1, 0.1, 0.1}), 7), 1).grid.size, Eigen::Vector3i(1, 2, 2));
  EXPECT_EQ(AsCoarseAs(Volume(GridOf({8, 8, 2}, {1, 1, 0.5}), 7), 1).grid.size, Eigen::Vector3i(8, 8, 2));
  EXPECT_EQ(AsCoarseAs(Volume(GridOf({8, 8, 3}, {1, 1, 0.3}), 7), 1).grid.size, Eigen::Vector3i(8, 8, 3));
}

// The mean of a ramp over some voxels is the ramp at their middle.
TEST(CoarserScan, ShowsMeansInTheirPlace) {
  const auto ramp = [](const Eigen::Vector3d& x) { return 10 + 2 * x.x() - 3 * x.y() + 0.5 * x.z(); };
  const Volume coarse = AsCoarseAs(Filled(GridOf({9, 8, 7}, {0.5, 1, 0.3}), ramp), 1);
  EXPECT_EQ(coarse.grid.size, Eigen::Vector3i(4, 8, 2));
  EXPECT_TRUE(coarse.grid.spacing_mm.isApprox(Eigen::Vector3d(1, 1, 0.9)));
  const Volume truth = Filled(coarse.grid, ramp);
  for (size_t v = 0; v < truth.values.size(); ++v) EXPECT_NEAR(coarse.values[v], truth.values[v], 1e-4) << v;
}

TEST(CoarserScan, AScanThatIsAsCoarseStaysAsItIs) {
  const Volume scan(GridOf({4, 5, 6}, {0.7, 1, 3}), 7);
  EXPECT_EQ(AsCoarseAs(scan, 1).grid, scan.grid);
}

}  // namespace
}  // namespace kvx
