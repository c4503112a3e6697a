// Counts and orders that can be read off.
#include "core/voxels/numbered_voxels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/voxels/neighbours.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

TEST(NumberedVoxels, TheLargestComeFirstAndEqualOnesInTheirOrder) {
  LabelMap labels(testing_support::Cubes({4, 3, 1}, 1.0));
  labels.values = {0, 3, 3, 1, 2, 3, 0, 5, 1, 0, 2, 0};
  const std::vector<size_t> voxels = VoxelsByNumber(labels);
  EXPECT_THAT(voxels, testing::ElementsAre(4, 2, 2, 3, 0, 1));
  EXPECT_THAT(LargestFirst(voxels), testing::ElementsAre(3, 1, 2, 5, 4));
}

TEST(Neighbours, AreThoseThatTheGridHolds) {
  const Grid grid = testing_support::Cubes({3, 3, 2}, 1.0);
  std::vector<size_t> around, beside;
  ForEachAround(grid, 0, [&](size_t v) { around.push_back(v); });
  ForEachNeighbour(grid, 0, [&](size_t v) { beside.push_back(v); });
  EXPECT_THAT(around, testing::ElementsAre(0, 1, 3, 4, 9, 10, 12, 13));
  EXPECT_THAT(beside, testing::ElementsAre(1, 3, 4, 9, 10, 12, 13));
  size_t of_middle = 0;
  ForEachNeighbour(grid, grid.Index(1, 1, 0), [&](size_t) { ++of_middle; });
  EXPECT_EQ(of_middle, 17u);
}

}  // namespace
}  // namespace kvx
