// Sums over blocks of 8 voxels, and over the 27 blocks around each.
#include "pipeline/registration/images/start_residual.h"

#include <cmath>

#include "core/parallel.h"

namespace kvx {
namespace {

constexpr double kWholeShare = 0.1;  // how much the whole level counts, in supports of average slope

struct Sums {
  double squares = 0, slopes = 0;
  double Voxels() const { return slopes > 0 ? std::sqrt(3 * squares / slopes) : 0.0; }
  Sums& operator+=(const Sums& other) {
    squares += other.squares, slopes += other.slopes;
    return *this;
  }
};

Sums AtVoxel(const BlockLevel& level, size_t v) {
  if (level.weight[v] <= 0) return {};
  const std::optional<double> seen = Landed(level, level.scan, v);
  if (!seen) return {};
  const double difference = *seen - level.intensity[v];
  return {level.weight[v] * std::max(0.0, difference * difference - 1),
          level.weight[v] * SlopeSquared(level, v)};
}

struct Blocks {
  Eigen::Vector3i size;
  std::vector<Sums> sums;
  size_t Index(const Eigen::Vector3i& b) const {
    return (size_t(b.z()) * size.y() + b.y()) * size.x() + b.x();
  }
  Eigen::Vector3i At(size_t n) const {
    return {int(n % size.x()), int(n / size.x() % size.y()), int(n / (size_t(size.x()) * size.y()))};
  }
};

Blocks SumsOfBlocks(const BlockLevel& level) {
  Blocks out{(level.grid.size.array() + kBlockVoxels - 1) / kBlockVoxels, {}};
  out.sums.resize(size_t(out.size.prod()));
  ParallelEach(out.sums.size(), [&](size_t b) {
    for (int n = 0; n < kBlockVoxels * kBlockVoxels * kBlockVoxels; ++n) {
      const Eigen::Vector3i p = kBlockVoxels * out.At(b) + Eigen::Vector3i(n % 8, n / 8 % 8, n / 64);
      if (level.grid.Contains(p)) out.sums[b] += AtVoxel(level, level.grid.Index(p.x(), p.y(), p.z()));
    }
  });
  return out;
}

Sums Whole(const Blocks& blocks) {
  Sums out;
  for (const Sums& sums : blocks.sums) out += sums;
  return out;
}

// Residual of the 27 blocks around each block.
std::vector<double> AroundBlocks(const Blocks& blocks) {
  std::vector<Sums> around(blocks.sums.size());
  double count = 0;
  for (size_t b = 0; b < around.size(); ++b) {
    for (int n = 0; n < 27; ++n) {
      const Eigen::Vector3i p = blocks.At(b) + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if ((p.array() >= 0).all() && (p.array() < blocks.size.array()).all())
        around[b] += blocks.sums[blocks.Index(p)];
    }
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

double ResidualVoxels(const BlockLevel& level) { return Whole(SumsOfBlocks(level)).Voxels(); }

std::vector<float> LocalResidualVoxels(const BlockLevel& level) {
  const Blocks blocks = SumsOfBlocks(level);
  const std::vector<double> around = AroundBlocks(blocks);
  const Grid cells = Coarsened(level.grid, 2);
  std::vector<float> out(cells.VoxelCount());
  ParallelEach(out.size(), [&](size_t c) {  // linear between the blocks' centres
    const Eigen::Vector3d at = (2 * cells.Ijk(c).cast<double>().array() + 1) / kBlockVoxels - 0.5;
    const Eigen::Vector3i lo = at.array().floor().cast<int>();
    for (int n = 0; n < 8; ++n) {
      double share = 1;
      Eigen::Vector3i b = lo;
      for (int a = 0; a < 3; ++a) {
        const bool upper = n >> a & 1;
        share *= upper ? at[a] - lo[a] : 1 - (at[a] - lo[a]);
        b[a] = std::clamp(lo[a] + int(upper), 0, blocks.size[a] - 1);
      }
      out[c] += float(share * around[blocks.Index(b)]);
    }
  });
  return out;
}

}  // namespace kvx
