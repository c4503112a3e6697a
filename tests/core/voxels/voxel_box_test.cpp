// Boxes of labels against what every voxel says.
#include "core/voxels/voxel_box.h"

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

TEST(BoxesOf, HoldsEveryLabelThatIsThere) {
  Grid grid;
  grid.size = {4, 3, 2};
  LabelMap labels(grid);
  labels(0, 1, 1) = 300, labels(2, 2, 1) = 300, labels(3, 0, 0) = 7;
  const std::map<int, VoxelBox> boxes = BoxesOf(labels);
  ASSERT_EQ(boxes.size(), 2u);
  EXPECT_EQ(boxes.at(300).low, Eigen::Vector3i(0, 1, 1));
  EXPECT_EQ(boxes.at(300).size(), Eigen::Vector3i(3, 2, 1));
  EXPECT_EQ(boxes.at(7).size(), Eigen::Vector3i::Ones());
}

TEST(Cropped, HoldsTheVoxelsOfTheBoxWhereTheyWere) {
  Grid grid;
  grid.size = {6, 5, 7};
  Volume volume(grid);
  for (size_t v = 0; v < volume.values.size(); ++v) volume.values[v] = float(v);
  const VoxelBox box{{1, 2, 3}, {5, 4, 7}};
  const Volume part = Cropped(volume, box);
  ASSERT_EQ(part.grid.size, box.size());
  for (size_t v = 0; v < part.values.size(); ++v) {
    const Eigen::Vector3i at = part.grid.Ijk(v), whole = at + box.low;
    EXPECT_EQ(part.values[v], volume(whole.x(), whole.y(), whole.z()));
    EXPECT_EQ(part.grid.ToMm(at.x(), at.y(), at.z()).lps, grid.ToMm(whole.x(), whole.y(), whole.z()).lps);
  }
}

TEST(ForEachVoxel, GoesThroughTheBoxAlongIFirst) {
  std::vector<Eigen::Vector3i> seen;
  ForEachVoxel(VoxelBox{{-1, 2, 3}, {1, 4, 5}}, [&](const Eigen::Vector3i& p) { seen.push_back(p); });
  ASSERT_EQ(seen.size(), 8u);
  EXPECT_EQ(seen[0], Eigen::Vector3i(-1, 2, 3));
  EXPECT_EQ(seen[1], Eigen::Vector3i(0, 2, 3));
  EXPECT_EQ(seen[2], Eigen::Vector3i(-1, 3, 3));
  EXPECT_EQ(seen[7], Eigen::Vector3i(0, 3, 4));
}

TEST(Within, IsTheImageItselfWhereTheBoxIsAllOfIt) {
  Grid grid;
  grid.size = {6, 5, 7};
  const Volume volume(grid);
  EXPECT_EQ(&*Within(volume, {Eigen::Vector3i::Zero(), grid.size}), &volume);
  EXPECT_EQ(Within(volume, {{0, 0, 0}, {6, 5, 6}})->grid.size, Eigen::Vector3i(6, 5, 6));
  EXPECT_EQ(Within(volume, {{0, 1, 0}, {6, 5, 7}})->grid.size, Eigen::Vector3i(6, 4, 7));
}

}  // namespace
}  // namespace kvx
