// A bar, and bodies whose volumes are known.
#include "pipeline/segmentation/ct/neck_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace kvx {
namespace {

TEST(PartAtNecks, ABarOfEvenWidthStaysWhole) {
  Grid grid;
  grid.size = {60, 30, 26};
  grid.spacing_mm = {0.8, 1.0, 1.2};
  Mask bar(grid);
  for (int k = 10; k < 16; ++k) {
    for (int j = 10; j < 18; ++j) {
      for (int i = 4; i < 55; ++i) bar(i, j, k) = 1;
    }
  }
  const NeckParts parts = PartAtNecks(bar);
  EXPECT_EQ(std::set<int32_t>(parts.part.values.begin(), parts.part.values.end()), (std::set<int32_t>{0, 1}));
  ASSERT_EQ(parts.depth_mm.size(), 2u);
  EXPECT_NEAR(parts.depth_mm[1], 3 * 1.2, 1e-5) << "three voxels out of the thinner side";
}

TEST(IsSolid, BallsAndShaftsAreAndShellsAreNot) {
  EXPECT_TRUE(IsSolid(4 * M_PI / 3 * 125, 5)) << "a ball";
  EXPECT_TRUE(IsSolid(M_PI * 25 * 60, 5)) << "a shaft six times as long as thick";
  EXPECT_FALSE(IsSolid(4 * M_PI / 3 * (1000 - 512), 1)) << "a hollow ball with a shell of 2 mm";
  EXPECT_FALSE(IsSolid(M_PI * (36 - 16) * 50, 1)) << "a tube with walls of 2 mm";
}

}  // namespace
}  // namespace kvx
