// Cubes of blocks are summed up by differences of sums from the first block on.
#include "pipeline/registration/result/carried_place.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/host/parallel.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// Blocks from a cube's middle one to its last.
constexpr std::array kReachesBlocks = {0, 1, 2, 4, 8};

// Parts of variances that count beside a block's own covariance, which has some of what the shared slopes
// leave open. Between blocks that show their place the prior follows tissue, beyond the last of them less so.
// Read from knees with noise, with noise and a coil that fades, and from a real knee that was registered both
// ways: docs/results/how-sure.md, "Where images show little".
constexpr double kOfOpen = 0.1, kOfBend = 0.1, kOfWay = 0.3;

struct Cube {
  SharedSlopes slopes;
  double shown = 0;                                    // 1/mm^2: the blocks' own information, over all axes
  Eigen::Vector3d shown_at = Eigen::Vector3d::Zero();  // in blocks, by what each shows

  Cube& operator+=(const Cube& other) {
    slopes += other.slopes, shown += other.shown, shown_at += other.shown_at;
    return *this;
  }
  Cube& operator-=(const Cube& other) {
    slopes -= other.slopes, shown -= other.shown, shown_at -= other.shown_at;
    return *this;
  }
};

class CubeSums {
 public:
  explicit CubeSums(const Image<SharedSlopes>& slopes) : from_first_(slopes.grid) {
    const Grid& grid = slopes.grid;
    for (size_t b = 0; b < slopes.values.size(); ++b) {
      const double shown = std::max(0.0, slopes.values[b].Information().trace());
      from_first_.values[b] = {slopes.values[b], shown, shown * grid.Ijk(b).cast<double>()};
    }
    for (int a = 0; a < 3; ++a) {
      for (size_t b = 0; b < from_first_.values.size(); ++b) {
        const Eigen::Vector3i before = grid.Ijk(b) - Eigen::Vector3i::Unit(a);
        if (before[a] >= 0) from_first_.values[b] += from_first_(before.x(), before.y(), before.z());
      }
    }
  }
  Cube Around(const Eigen::Vector3i& middle, int reach) const {
    const Eigen::Vector3i before = middle.array() - reach - 1;
    const Eigen::Vector3i last = from_first_.grid.Nearest(Eigen::Vector3i(middle.array() + reach));
    Cube sum;
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
  Image<Cube> from_first_;
};

const Eigen::Vector3f& At(const Image<Eigen::Vector3f>& moved_mm, const Eigen::Vector3i& block) {
  return moved_mm(block.x(), block.y(), block.z());
}

// Calls visit(block, step) for steps of so many blocks along every axis that stay on the grid.
template <class Visit>
void ForEachStep(const Grid& blocks, int apart, const Visit& visit) {
  for (size_t b = 0; b < blocks.VoxelCount(); ++b) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3i block = blocks.Ijk(b), step = apart * Eigen::Vector3i::Unit(a);
      if (blocks.Contains(Eigen::Vector3i(block + step))) visit(block, step);
    }
  }
}

// Along one axis of three, on average; ways that are not known are left out, and without any it is 0.
class MeanSquareMm2 {
 public:
  void Add(const Eigen::Vector3f& way_mm) {
    if (way_mm.allFinite()) sum_ += way_mm.squaredNorm() / 3, count_ += 1;
  }
  operator double() const { return count_ > 0 ? sum_ / count_ : 0; }

 private:
  double sum_ = 0, count_ = 0;
};

// From the mean of what lies so many blocks to both sides.
double BendMm2(const Image<Eigen::Vector3f>& moved_mm, int apart) {
  MeanSquareMm2 mean;
  ForEachStep(moved_mm.grid, apart, [&](const Eigen::Vector3i& block, const Eigen::Vector3i& step) {
    const Eigen::Vector3i before = block - step, after = block + step;
    if (moved_mm.grid.Contains(before))
      mean.Add(At(moved_mm, block) - 0.5f * (At(moved_mm, before) + At(moved_mm, after)));
  });
  return mean;
}

// From one block to the next.
double StepMm2(const Image<Eigen::Vector3f>& moved_mm) {
  MeanSquareMm2 mean;
  ForEachStep(moved_mm.grid, 1, [&](const Eigen::Vector3i& block, const Eigen::Vector3i& step) {
    mean.Add(At(moved_mm, Eigen::Vector3i(block + step)) - At(moved_mm, block));
  });
  return mean;
}

double WayMm2(const Image<Eigen::Vector3f>& moved_mm) {
  MeanSquareMm2 mean;
  for (const Eigen::Vector3f& way_mm : moved_mm.values) mean.Add(way_mm);
  return mean;
}

// mm^2, summed over the axes. `carried_mm2`: along one axis, between what the slopes show and the block;
// `unknown_mm2`: of what they do not show.
double LeftOpenMm2(const SharedSlopes& slopes, double carried_mm2, double unknown_mm2) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(slopes.Information(), Eigen::EigenvaluesOnly);
  double sum = 0;
  for (const double information : axes.eigenvalues())
    sum += information > 0 ? std::min(unknown_mm2, kOfOpen / information + carried_mm2) : unknown_mm2;
  return sum;
}

}  // namespace

Volume CarriedVariancesMm2(const Image<SharedSlopes>& slopes, const Image<Eigen::Vector3f>& moved_mm) {
  std::array<double, kReachesBlocks.size()> bends_mm2{};  // of a block alone, none
  for (size_t r = 1; r < bends_mm2.size(); ++r)           // of wider cubes, no less
    bends_mm2[r] = std::max(bends_mm2[r - 1], kOfBend * BendMm2(moved_mm, kReachesBlocks[r]));
  const double step_mm2 = kOfWay * StepMm2(moved_mm), unknown_mm2 = kOfWay * WayMm2(moved_mm);
  const CubeSums sums(slopes);
  Volume out(slopes.grid);
  ParallelEach(out.values.size(), [&](size_t b) {
    const Eigen::Vector3i block = out.grid.Ijk(b);
    double least_mm2 = 3 * unknown_mm2;
    for (size_t r = 0; r < bends_mm2.size(); ++r) {
      const Cube cube = sums.Around(block, kReachesBlocks[r]);
      if (cube.shown <= 0) continue;
      const double aside_blocks = (cube.shown_at / cube.shown - block.cast<double>()).norm();
      const double carried_mm2 = r > 0 ? bends_mm2[r] + step_mm2 * aside_blocks * aside_blocks : 0;
      least_mm2 = std::min(least_mm2, LeftOpenMm2(cube.slopes, carried_mm2, unknown_mm2));
    }
    out.values[b] = float(least_mm2);
  });
  return out;
}

}  // namespace kvx
