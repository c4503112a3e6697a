// Sums over blocks of 8 voxels, and over the 27 blocks around each.
#include "pipeline/registration/images/start_residual.h"

#include <cmath>

#include "core/host/parallel.h"
#include "core/voxels/neighbours.h"

namespace kvx {
namespace {

constexpr double kWholeShare = 0.1;  // how much the whole level counts, in supports of average slope

using Sums = StartResidual::Sums;

Sums AtVoxel(const BlockLevel& level, size_t v) {
  const std::optional<double> seen = Landed(level, level.scan, v);
  if (!seen) return {};
  const double difference = *seen - level.intensity[v];
  return {level.weight[v] * std::max(0.0, difference * difference - 1),
          level.weight[v] * SlopeSquared(level, v)};
}

Sums OfBlock(const BlockLevel& level, const Eigen::Vector3i& block) {
  const Eigen::Vector3i first = kBlockVoxels * block;
  const Eigen::Vector3i end = (first.array() + kBlockVoxels).min(level.grid.size.array());
  Sums out;
  for (int k = first.z(); k < end.z(); ++k) {
    for (int j = first.y(); j < end.y(); ++j) {
      const size_t row = level.grid.Index(0, j, k);
      for (int i = first.x(); i < end.x(); ++i) {
        if (level.weight[row + i] > 0) out += AtVoxel(level, row + i);
      }
    }
  }
  return out;
}

Sums Whole(const std::vector<Sums>& blocks) {
  Sums out;
  for (const Sums& sums : blocks) out += sums;
  return out;
}

// Residual of the 27 blocks around each block.
std::vector<double> AroundBlocks(const Grid& grid, const std::vector<Sums>& blocks) {
  std::vector<Sums> around(blocks.size());
  double count = 0;
  for (size_t b = 0; b < around.size(); ++b) {
    ForEachAround(grid, b, [&](size_t near) { around[b] += blocks[near]; });
    count += around[b].slopes > 0;
  }
  const Sums whole = Whole(blocks);
  const double share = kWholeShare * 27 / std::max(1.0, count);  // every block is in 27 sums
  std::vector<double> out;
  for (Sums& sums : around) {
    sums += {share * whole.squares, share * whole.slopes};
    out.push_back(sums.Voxels());
  }
  return out;
}

}  // namespace

double StartResidual::Sums::Voxels() const { return slopes > 0 ? std::sqrt(3 * squares / slopes) : 0.0; }

StartResidual::Sums& StartResidual::Sums::operator+=(const Sums& other) {
  squares += other.squares, slopes += other.slopes;
  return *this;
}

StartResidual::StartResidual(const BlockLevel& level) : cells_(Coarsened(level.grid, 2)) {
  blocks_.size = (level.grid.size.array() + kBlockVoxels - 1) / kBlockVoxels;
  sums_.resize(blocks_.VoxelCount());
  ParallelEach(sums_.size(), [&](size_t b) { sums_[b] = OfBlock(level, blocks_.Ijk(b)); });
}

bool LandsInside(const BlockLevel& level, const Grid& scan, size_t voxel) {
  return scan.Contains(PointVox{level.start[voxel].head<3>().cast<double>()});
}

std::optional<double> Landed(const BlockLevel& level, const Volume& scan, size_t voxel) {
  if (!LandsInside(level, scan.grid, voxel)) return std::nullopt;
  return SampleTrilinear(scan, PointVox{level.start[voxel].head<3>().cast<double>()});
}

double SlopeSquared(const BlockLevel& level, size_t voxel) {
  const Eigen::Vector3i p = level.grid.Ijk(voxel);
  double sum = 0;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3i lo = (p - Eigen::Vector3i::Unit(a)).cwiseMax(0);
    const Eigen::Vector3i hi =
        (p + Eigen::Vector3i::Unit(a)).cwiseMin((level.grid.size.array() - 1).matrix());
    const double slope = 0.5 * (level.intensity[level.grid.Index(hi.x(), hi.y(), hi.z())] -
                                level.intensity[level.grid.Index(lo.x(), lo.y(), lo.z())]);
    sum += slope * slope;
  }
  return sum;
}

double StartResidual::Voxels() const { return Whole(sums_).Voxels(); }

std::vector<float> StartResidual::LocalVoxels() const {
  const std::vector<double> around = AroundBlocks(blocks_, sums_);
  std::vector<float> out(cells_.VoxelCount());
  ParallelEach(out.size(), [&](size_t c) {  // linear between the blocks' centres
    const Eigen::Vector3d at = (2 * cells_.Ijk(c).cast<double>().array() + 1) / kBlockVoxels - 0.5;
    const Eigen::Vector3i lo = at.array().floor().cast<int>();
    for (int n = 0; n < 8; ++n) {
      double share = 1;
      Eigen::Vector3i b = lo;
      for (int a = 0; a < 3; ++a) {
        const bool upper = n >> a & 1;
        share *= upper ? at[a] - lo[a] : 1 - (at[a] - lo[a]);
        b[a] = std::clamp(lo[a] + int(upper), 0, blocks_.size[a] - 1);
      }
      out[c] += float(share * around[blocks_.Index(b.x(), b.y(), b.z())]);
    }
  });
  return out;
}

}  // namespace kvx
