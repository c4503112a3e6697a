// Part of a scan on larger voxels: blocks of voxels in one.
#pragma once
#include <vector>

#include "core/image.h"
#include "core/voxels/voxel_box.h"

namespace kvx {

// A box of a scan's voxels, and how many of them along i, j, k make a larger one. Blocks begin at box.low;
// the last ones may be cut short.
struct BlockedBox {
  VoxelBox box;
  Eigen::Vector3i block = Eigen::Vector3i::Ones();

  Eigen::Vector3i size() const;  // in blocks
  Grid GridIn(const Grid& scan) const;
  // Of a block's middle, rounded down.
  Eigen::Vector3i VoxelOf(const Eigen::Vector3i& p) const;
};

// Sizes of blocks, from single voxels on: each at most twice the one before, the shortest edges first, until
// no more than `most_blocks` fill the box.
std::vector<Eigen::Vector3i> BlocksFor(const VoxelBox& box, const Grid& scan, size_t most_blocks);

// Means of blocks.
Volume Coarser(const Volume& scan, const BlockedBox& part);
// `label` where a block has any of its strokes, else the lowest mark in the block.
LabelMap Coarser(const LabelMap& strokes, const BlockedBox& part, int label);

}  // namespace kvx
