// Against looking at each voxel's six neighbours.
#include "pipeline/segmentation/dilated.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

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

}  // namespace
}  // namespace kvx
