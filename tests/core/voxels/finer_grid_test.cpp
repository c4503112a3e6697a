// Grids that can be written down.
#include "core/voxels/finer_grid.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

Grid GridOf(const Eigen::Vector3d& spacing_mm) {
  Grid grid;
  grid.size = {5, 6, 7};
  grid.spacing_mm = spacing_mm;
  grid.origin.lps = {3, -4, 5};
  grid.direction = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  return grid;
}

TEST(FinerGrid, KeepsEveryVoxelAndGoesNoFarther) {
  const Grid grid = GridOf({3, 1, 2}), finer = FinerGrid(grid, {3, 1, 2});
  EXPECT_EQ(finer.size, Eigen::Vector3i(13, 6, 13));
  EXPECT_TRUE(finer.spacing_mm.isApprox(Eigen::Vector3d(1, 1, 1)));
  EXPECT_TRUE(finer.ToMm(12, 5, 12).lps.isApprox(grid.ToMm(4, 5, 6).lps));
  EXPECT_TRUE(finer.ToMm(6, 3, 4).lps.isApprox(grid.ToMm(2, 3, 2).lps));
  EXPECT_EQ(CoarserGrid(finer, {3, 1, 2}), grid);
}

TEST(FinerGrid, NearlyCubesStayAsTheyAre) {
  EXPECT_EQ(TimesTowardsCubes(GridOf({2, 2, 2.6})), Eigen::Vector3i(1, 1, 1));
}

// A cube of the volume of 0.5 x 0.5 x 3 mm is 0.91 mm wide, of 3.75 x 1.25 x 1.2 mm 1.78 mm, of 0.3 x 0.3 x 6
// mm 0.81 mm.
TEST(FinerGrid, ThickSlicesAreSplitTowardsACubeOfTheSameVolume) {
  EXPECT_EQ(TimesTowardsCubes(GridOf({0.5, 0.5, 3})), Eigen::Vector3i(1, 1, 3));
  EXPECT_EQ(TimesTowardsCubes(GridOf({3.75, 1.25, 1.2})), Eigen::Vector3i(2, 1, 1));
  EXPECT_EQ(TimesTowardsCubes(GridOf({0.3, 0.3, 6})), Eigen::Vector3i(1, 1, kMostTimesFiner));
}

}  // namespace
}  // namespace kvx
