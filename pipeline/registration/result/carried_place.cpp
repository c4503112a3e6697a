// Cubes of blocks are summed up by differences of sums from the first block on.
#include "pipeline/registration/result/carried_place.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "core/host/parallel.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// Blocks from a cube's middle one to its last.
constexpr std::array kReachesBlocks = {0, 1, 2, 4, 8};

// Beside a block's own covariance counts only a part: of what the shared slopes leave open, because the
// covariance has it in part, and of how differently places move, because most of that follows from what lies
// between. Read from knees and hands with noise, and with noise and a coil that fades:
// docs/results/how-sure.md, "Where images show little".
constexpr double kPerOpen = 0.2, kPerSpread = 0.06;

class CubeSums {
 public:
  explicit CubeSums(Image<SharedSlopes> slopes) : from_first_(std::move(slopes)) {
    for (int a = 0; a < 3; ++a) {
      for (size_t b = 0; b < from_first_.values.size(); ++b) {
        const Eigen::Vector3i before = from_first_.grid.Ijk(b) - Eigen::Vector3i::Unit(a);
        if (before[a] >= 0) from_first_.values[b] += from_first_(before.x(), before.y(), before.z());
      }
    }
  }
  SharedSlopes operator()(const Eigen::Vector3i& middle, int reach) const {
    const Eigen::Vector3i before = middle.array() - reach - 1;
    const Eigen::Vector3i last = from_first_.grid.Nearest(Eigen::Vector3i(middle.array() + reach));
    SharedSlopes sum;
    for (unsigned c = 0; c < 8; ++c) {
      const Eigen::Vector3i at = (ToCorner(int(c)).array() > 0).select(last, before);
      if ((at.array() < 0).any()) continue;
      if (std::popcount(c) % 2 == 1)
        sum += from_first_(at.x(), at.y(), at.z());
      else
        sum -= from_first_(at.x(), at.y(), at.z());
    }
    return sum;
  }

 private:
  Image<SharedSlopes> from_first_;
};

// mm^2 along one axis, on average over blocks of the body: by how much places move differently that are so
// many blocks apart; 0 where none are.
double SpreadMm2(const Image<Eigen::Vector3f>& moved_mm, int apart) {
  double sum = 0, count = 0;
  for (size_t b = 0; b < moved_mm.values.size(); ++b) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3i other = moved_mm.grid.Ijk(b) + apart * Eigen::Vector3i::Unit(a);
      if (!moved_mm.grid.Contains(other)) continue;
      const Eigen::Vector3f way = moved_mm.values[b] - moved_mm(other.x(), other.y(), other.z());
      if (way.allFinite()) sum += way.squaredNorm() / 3, count += 1;
    }
  }
  return count > 0 ? sum / count : 0;
}

// mm^2 along one axis: of places of which nothing is known but how far tissue moves in this scan.
double UnknownMm2(const Image<Eigen::Vector3f>& moved_mm) {
  double sum = 0, count = 0;
  for (const Eigen::Vector3f& way : moved_mm.values)
    if (way.allFinite()) sum += way.squaredNorm() / 3, count += 1;
  return count > 0 ? sum / count : 0;
}

// mm^2, summed over the axes.
double LeftOpenMm2(const SharedSlopes& slopes, double spread_mm2, double unknown_mm2) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(slopes.Information(), Eigen::EigenvaluesOnly);
  double sum = 0;
  for (const double information : axes.eigenvalues())
    sum += information > 0 ? std::min(unknown_mm2, kPerOpen / information + spread_mm2) : unknown_mm2;
  return sum;
}

}  // namespace

Volume CarriedVariancesMm2(const Image<SharedSlopes>& slopes, const Image<Eigen::Vector3f>& moved_mm) {
  std::array<double, kReachesBlocks.size()> spreads_mm2{};  // of a block alone, none
  for (size_t r = 1; r < spreads_mm2.size(); ++r)
    spreads_mm2[r] = std::max(spreads_mm2[r - 1], kPerSpread * SpreadMm2(moved_mm, kReachesBlocks[r]));
  const double unknown_mm2 = std::max(kPerSpread * UnknownMm2(moved_mm), spreads_mm2.back());
  const CubeSums sums(slopes);
  Volume out(slopes.grid);
  ParallelEach(out.values.size(), [&](size_t b) {
    double least_mm2 = 3 * unknown_mm2;
    for (size_t r = 0; r < spreads_mm2.size(); ++r)
      least_mm2 = std::min(
          least_mm2, LeftOpenMm2(sums(out.grid.Ijk(b), kReachesBlocks[r]), spreads_mm2[r], unknown_mm2));
    out.values[b] = float(least_mm2);
  });
  return out;
}

}  // namespace kvx
