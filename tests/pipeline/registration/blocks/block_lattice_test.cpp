// Which blocks have something to gain.
#include "pipeline/registration/blocks/block_lattice.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

BlockLevel AllCount() {
  BlockLevel level;
  level.grid.size = {80, 24, 24};
  level.weight.assign(level.grid.VoxelCount(), 1.0f);
  return level;
}

TEST(BlockLattice, ABlockAtRestIsAwakeOnceItsSupportHasChanged) {
  BlockLattice lattice(AllCount());
  BlockLattice::Block& first = lattice.blocks(0).front();
  EXPECT_TRUE(lattice.Awake(first));
  lattice.Visited(first, false);
  EXPECT_FALSE(lattice.Awake(first));
  const auto end = first.support.s[0] + kSupportVoxels;
  lattice.Changed({end, 0, 0}, kSupportVoxels);
  EXPECT_FALSE(lattice.Awake(first));
  lattice.Changed({end - 4, 0, 0}, kSupportVoxels);
  EXPECT_TRUE(lattice.Awake(first));
}

TEST(BlockLattice, ABlockThatMovedWakesItselfAndItsNeighbours) {
  BlockLattice lattice(AllCount());
  std::vector<BlockLattice::Block>& blocks = lattice.blocks(0);
  for (BlockLattice::Block& block : blocks) lattice.Visited(block, false);
  lattice.Visited(blocks.front(), true);
  for (const BlockLattice::Block& block : blocks) {
    const int apart = block.support.s[0] - blocks.front().support.s[0];
    EXPECT_EQ(lattice.Awake(block), apart < kSupportVoxels) << apart;
  }
}

}  // namespace
}  // namespace kvx
