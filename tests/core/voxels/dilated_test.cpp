// Against looking at each voxel's six neighbours, or at every distance.
#include "core/voxels/dilated.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ObliqueGrid;

TEST(Dilated, AndErodedAreTheMostAndTheLeastOfAVoxelAndThoseBesideIt) {
  for (const Eigen::Vector3i& size : {Eigen::Vector3i(9, 7, 5), Eigen::Vector3i(1, 4, 3),
                                      Eigen::Vector3i(6, 1, 2), Eigen::Vector3i(3, 3, 1)}) {
    Mask mask;
    mask.grid.size = size;
    mask.values.resize(mask.grid.VoxelCount());
    std::mt19937 random(3);
    for (uint8_t& m : mask.values) m = random() % 2;
    const Mask dilated = Dilated(mask), eroded = Eroded(mask);
    for (size_t v = 0; v < mask.values.size(); ++v) {
      uint8_t most = mask.values[v], least = most;
      for (int n = 0; n < 6; ++n) {
        Eigen::Vector3i p = mask.grid.Ijk(v);
        p[n / 2] += n % 2 ? 1 : -1;
        if (!mask.grid.Contains(p)) continue;
        most = std::max(most, mask(p.x(), p.y(), p.z())), least = std::min(least, mask(p.x(), p.y(), p.z()));
      }
      EXPECT_EQ(dilated.values[v], most) << size.transpose() << " voxel " << v;
      EXPECT_EQ(eroded.values[v], least) << size.transpose() << " voxel " << v;
    }
  }
}

TEST(Dilated, EveryVoxelWithinTheRadiusAndNoOther) {
  const Grid grid = ObliqueGrid({21, 15, 12});
  Mask seeds(grid, 0);
  const std::vector<Eigen::Vector3i> places{{3, 4, 5}, {15, 9, 2}, {16, 9, 2}, {20, 14, 11}};
  for (const Eigen::Vector3i& p : places) seeds(p.x(), p.y(), p.z()) = 1;
  for (const double radius_mm : {0.0, 0.9, 3.0, 7.5}) {
    const Mask dilated = Dilated(seeds, radius_mm);
    for (size_t v = 0; v < dilated.values.size(); ++v) {
      double nearest_mm = 1e9;
      for (const Eigen::Vector3i& p : places) {
        nearest_mm =
            std::min(nearest_mm, (grid.Ijk(v) - p).cast<double>().cwiseProduct(grid.spacing_mm).norm());
      }
      ASSERT_EQ(int(dilated.values[v]), nearest_mm <= radius_mm)
          << grid.Ijk(v).transpose() << " at " << nearest_mm;
    }
  }
}

// Three voxels of 0.1 mm are 0.3 mm, however they are rounded.
TEST(Dilated, AVoxelExactlyAtTheRadiusBelongsToIt) {
  Grid grid;
  grid.size = {21, 3, 3};
  for (const double spacing_mm : {0.1, 0.3, 0.7, 1.1, 1.4}) {
    grid.spacing_mm = Eigen::Vector3d::Constant(spacing_mm);
    Mask seed(grid);
    seed(0, 1, 1) = 1;
    for (int reach = 1; reach < 20; ++reach) {
      const Mask dilated = Dilated(seed, std::stod(std::to_string(reach * spacing_mm)));
      EXPECT_EQ(dilated(reach, 1, 1), 1) << reach << " times " << spacing_mm;
      EXPECT_EQ(dilated(reach + 1, 1, 1), 0) << reach << " times " << spacing_mm;
    }
  }
}

TEST(Dilated, NothingStaysNothing) {
  const Mask dilated = Dilated(Mask(ObliqueGrid(), 0), 100);
  EXPECT_EQ(std::count(dilated.values.begin(), dilated.values.end(), 0),
            std::ptrdiff_t(dilated.values.size()));
}

// A slab of 8 mm that the view cuts on all other sides.
TEST(Eroded, GivesWayFromWhatTheMaskLeavesOutAlone) {
  Grid grid;
  grid.size = {24, 5, 4};
  grid.spacing_mm = {0.5, 1.0, 2.0};
  Mask slab(grid);
  for (size_t v = 0; v < slab.values.size(); ++v)
    slab.values[v] = grid.Ijk(v).x() >= 4 && grid.Ijk(v).x() < 20;
  const Mask eroded = Eroded(slab, 1.0);
  for (size_t v = 0; v < slab.values.size(); ++v)
    EXPECT_EQ(int(eroded.values[v]), grid.Ijk(v).x() >= 6 && grid.Ijk(v).x() < 18) << grid.Ijk(v).transpose();
  EXPECT_EQ(Eroded(Mask(grid, 1), 3.0).values, Mask(grid, 1).values);
}

}  // namespace
}  // namespace kvx
