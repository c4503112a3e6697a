// Block bookkeeping on the host.
#include "pipeline/registration/blocks/block_lattice.h"

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr int kHalf = kBlockVoxels / 2;
constexpr double kLeastShare = 0.05;  // of a block's voxels that count, for the block to be registered

double CountingShare(const BlockLevel& level, const Eigen::Vector3i& first) {
  int counting = 0;
  for (int n = 0; n < kBlockVoxels * kBlockVoxels * kBlockVoxels; ++n) {
    const Eigen::Vector3i p = first + Eigen::Vector3i(n % 8, n / 8 % 8, n / 64);
    if (level.grid.Contains(p)) counting += level.weight[level.grid.Index(p.x(), p.y(), p.z())] > 0;
  }
  return counting / double(kBlockVoxels * kBlockVoxels * kBlockVoxels);
}

}  // namespace

BlockLattice::BlockLattice(const BlockLevel& level)
    : patches_((level.grid.size.array() + kHalf - 1) / kHalf), changed_(patches_.prod(), 0) {
  for (const int shifted : {0, 1}) {
    const int offset = shifted ? -kHalf : 0;
    const Eigen::Vector3i count = (level.grid.size.array() - offset + kBlockVoxels - 1) / kBlockVoxels;
    const auto block_at = [&](int n) {
      return Eigen::Vector3i(n % count.x(), n / count.x() % count.y(), n / (count.x() * count.y()));
    };
    const auto first_voxel = [&](int n) -> Eigen::Vector3i {
      return kBlockVoxels * block_at(n) + Eigen::Vector3i::Constant(offset);
    };
    std::vector<uint8_t> counts(size_t(count.prod()));
    ParallelEach(counts.size(),
                 [&](size_t n) { counts[n] = CountingShare(level, first_voxel(int(n))) >= kLeastShare; });
    for (int n = 0; n < count.prod(); ++n) {
      if (!counts[size_t(n)]) continue;
      const Eigen::Vector3i b = block_at(n), s = first_voxel(n) - Eigen::Vector3i::Constant(kBlockVoxels);
      blocks_[shifted].push_back(
          {{{s.x(), s.y(), s.z(), 0}}, b.x() % 3 + 3 * (b.y() % 3) + 9 * (b.z() % 3), -1});
    }
  }
}

template <class Visit>
void BlockLattice::ForEachPatch(const Eigen::Vector3i& first_voxel, int voxels, Visit visit) const {
  const Eigen::Vector3i first = first_voxel / kHalf;
  const Eigen::Vector3i lo = first.cwiseMax(0);
  const Eigen::Vector3i hi = (first.array() + voxels / kHalf).matrix().cwiseMin(patches_);
  for (int k = lo.z(); k < hi.z(); ++k) {
    for (int j = lo.y(); j < hi.y(); ++j) {
      for (int i = lo.x(); i < hi.x(); ++i) visit((size_t(k) * patches_.y() + j) * patches_.x() + i);
    }
  }
}

template <class Visit>
void BlockLattice::ForEachPatch(const Block& block, Visit visit) const {
  ForEachPatch(Eigen::Map<const Eigen::Vector3i>(block.support.s), kSupportVoxels, visit);
}

bool BlockLattice::Awake(const Block& block) const {
  bool awake = false;
  ForEachPatch(block, [&](size_t patch) { awake = awake || changed_[patch] > block.visited; });
  return awake;
}

void BlockLattice::Visited(Block& block, bool moved) {
  ++clock_;
  if (moved) ForEachPatch(block, [&](size_t patch) { changed_[patch] = clock_; });
  // A block that moved is visited again: its own step may not have been the last.
  block.visited = moved ? clock_ - 1 : clock_;
}

void BlockLattice::Changed(const Eigen::Vector3i& first, int voxels) {
  ++clock_;
  ForEachPatch(first, voxels, [&](size_t patch) { changed_[patch] = clock_; });
}

}  // namespace kvx
