// The blocks of one level: which there are, which may be solved side by side,
// and which still have something to gain.
#pragma once
#include <vector>

#include "kernels/block_level.h"

namespace kvx {

constexpr int kColours = 27;  // blocks three apart have disjoint supports

// Two lattices of blocks, the second shifted by half a block along every axis.
class BlockLattice {
 public:
  explicit BlockLattice(const BlockLevel& level);

  struct Block {
    cl_int4 support;  // first voxel
    int colour = 0;
    int visited = -1;  // clock of the last visit
  };
  std::vector<Block>& blocks(int shifted) { return blocks_[shifted]; }

  // Something in the block's support has changed since its last visit.
  bool Awake(const Block& block) const;
  // The block has been visited, and its support changed if `moved`.
  void Visited(Block& block, bool moved);
  // Somebody else has changed what lies in these voxels, so many along every axis from the first on.
  void Changed(const Eigen::Vector3i& first, int voxels);

 private:
  template <class Visit>
  void ForEachPatch(const Eigen::Vector3i& first, int voxels, Visit visit) const;
  template <class Visit>
  void ForEachPatch(const Block& block, Visit visit) const;

  Eigen::Vector3i patches_;   // of kBlockVoxels / 2 voxels
  std::vector<int> changed_;  // clock of the last change of every patch
  std::vector<Block> blocks_[2];
  int clock_ = 0;
};

}  // namespace kvx
