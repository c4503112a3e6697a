// Boxes of labels against what every voxel says.
#include "core/voxel_box.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

TEST(BoxOf, ALabelsVoxelsIsTheLeastThatHoldsThem) {
  std::mt19937 random(11);
  for (int round = 0; round < 20; ++round) {
    Grid grid;
    grid.size = {5 + round, 7, 4};
    LabelMap labels(grid);
    VoxelBox least;
    for (size_t v = 0; v < labels.values.size(); ++v) {
      labels.values[v] = random() % 40 == 0 ? 300 : uint16_t(random() % 3);
      if (labels.values[v] == 300) least.Include(grid.Ijk(v));
    }
    const VoxelBox box = BoxOf(labels, 300);
    EXPECT_EQ(box.low, least.low) << round;
    EXPECT_EQ(box.high, least.high) << round;
  }
}

TEST(BoxOf, ALabelThatIsNotThereIsEmpty) {
  Grid grid;
  grid.size = {4, 3, 2};
  EXPECT_TRUE(BoxOf(LabelMap(grid, 7), 8).empty());
}

}  // namespace
}  // namespace kvx
