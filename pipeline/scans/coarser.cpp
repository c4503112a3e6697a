// One pass over the voxels of the box; a block of one voxel is that voxel.
#include "pipeline/scans/coarser.h"

namespace kvx {
namespace {

constexpr double kAsLong = 1.5;  // edges up to so many times the shortest are as long

// Calls visit(block, index of the voxel in the scan).
template <class Visit>
void ForEachInBlocks(const Grid& scan, const BlockedBox& part, const Grid& blocks, Visit&& visit) {
  for (int k = part.box.low.z(); k < part.box.high.z(); ++k) {
    for (int j = part.box.low.y(); j < part.box.high.y(); ++j) {
      const size_t row =
          blocks.Index(0, (j - part.box.low.y()) / part.block.y(), (k - part.box.low.z()) / part.block.z());
      size_t voxel = scan.Index(part.box.low.x(), j, k);
      for (int i = 0; i < part.box.size().x(); ++i) visit(row + size_t(i / part.block.x()), voxel++);
    }
  }
}

}  // namespace

Eigen::Vector3i BlockedBox::size() const {
  return ((box.size() + block).array() - 1).matrix().cwiseQuotient(block);
}

Grid BlockedBox::GridIn(const Grid& scan) const {
  Grid grid = scan;
  grid.size = size();
  grid.spacing_mm = scan.spacing_mm.cwiseProduct(block.cast<double>());
  const Eigen::Vector3d first = box.low.cast<double>() + 0.5 * (block.cast<double>().array() - 1).matrix();
  grid.origin = scan.ToMm(PointVox{first});
  return grid;
}

Eigen::Vector3i BlockedBox::VoxelOf(const Eigen::Vector3i& p) const {
  const Eigen::Vector3i middle = ((block.array() - 1) / 2).matrix();
  return (box.low + p.cwiseProduct(block) + middle).cwiseMin((box.high.array() - 1).matrix());
}

std::vector<Eigen::Vector3i> BlocksFor(const VoxelBox& box, const Grid& scan, size_t most_blocks) {
  std::vector<Eigen::Vector3i> blocks{Eigen::Vector3i::Ones()};
  while (BlockedBox{box, blocks.back()}.GridIn(scan).VoxelCount() > most_blocks) {
    Eigen::Vector3i next = blocks.back();
    const Eigen::Vector3d edges_mm = scan.spacing_mm.cwiseProduct(next.cast<double>());
    for (int axis = 0; axis < 3; ++axis) {
      if (edges_mm[axis] <= kAsLong * edges_mm.minCoeff()) next[axis] *= 2;
    }
    blocks.push_back(next);
  }
  return blocks;
}

Volume Coarser(const Volume& scan, const BlockedBox& part) {
  if (part.block == Eigen::Vector3i::Ones()) return Within(scan, part.box).Taken();
  Volume out(part.GridIn(scan.grid));
  std::vector<uint16_t> voxels(out.values.size(), 0);
  ForEachInBlocks(scan.grid, part, out.grid, [&](size_t block, size_t voxel) {
    out.values[block] += scan.values[voxel], ++voxels[block];
  });
  for (size_t b = 0; b < voxels.size(); ++b) out.values[b] /= float(voxels[b]);
  return out;
}

LabelMap Coarser(const LabelMap& strokes, const BlockedBox& part, int label) {
  LabelMap out(part.GridIn(strokes.grid));
  ForEachInBlocks(strokes.grid, part, out.grid, [&](size_t block, size_t voxel) {
    const uint16_t mark = strokes.values[voxel];
    uint16_t& kept = out.values[block];
    if (mark == 0 || kept == label) return;
    if (kept == 0 || mark == label || mark < kept) kept = mark;
  });
  return out;
}

}  // namespace kvx
