// Grids against arithmetic on paper.
#include "core/grid.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "core/errors.h"
#include "core/voxels/grid_lines.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(Grid, VoxelsAndMillimetresAreInverse) {
  const Grid grid = ObliqueGrid();
  const PointVox p{{3.25, 7.5, -2.0}};
  EXPECT_TRUE(grid.ToVox(grid.ToMm(p)).ijk.isApprox(p.ijk, 1e-12));
  EXPECT_TRUE(grid.ToMm(0, 0, 0).lps.isApprox(grid.origin.lps));
  const Eigen::Vector3d step = grid.ToMm(1, 0, 0).lps - grid.ToMm(0, 0, 0).lps;
  EXPECT_NEAR(step.norm(), grid.spacing_mm.x(), 1e-12);
  EXPECT_TRUE(step.normalized().isApprox(grid.direction.col(0), 1e-12));
}

TEST(Grid, MemoryRunsAlongIFirst) {
  const Grid grid = ObliqueGrid({5, 4, 3});
  EXPECT_EQ(grid.Index(1, 0, 0), 1u);
  EXPECT_EQ(grid.Index(0, 1, 0), 5u);
  EXPECT_EQ(grid.Index(0, 0, 1), 20u);
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    ASSERT_EQ(grid.Index(p.x(), p.y(), p.z()), v);
  }
}

TEST(Grid, CoarsenedBlocksShareTheirCentres) {
  const Grid grid = ObliqueGrid({9, 8, 7});
  const Grid coarse = Coarsened(grid, 2);
  EXPECT_EQ(coarse.size, Eigen::Vector3i(5, 4, 4));
  EXPECT_TRUE(coarse.ToMm(1, 2, 0).lps.isApprox(grid.ToMm(PointVox{{2.5, 4.5, 0.5}}).lps, 1e-12));
}

TEST(Grid, ContainsTheHullOfVoxelCentres) {
  const Grid grid = ObliqueGrid({5, 4, 3});
  EXPECT_TRUE(grid.Contains(PointVox{{4.0, 3.0, 2.0}}));
  EXPECT_FALSE(grid.Contains(PointVox{{4.01, 3.0, 2.0}}));
  EXPECT_FALSE(grid.Contains(PointVox{{0.0, -0.01, 0.0}}));
  EXPECT_FALSE(grid.Contains(Eigen::Vector3i(5, 0, 0)));
}

TEST(Grid, ImpossibleGridsAreRefused) {
  const auto refused = [](auto&& spoil) {
    Grid grid = ObliqueGrid();
    spoil(grid);
    EXPECT_THROW(Validate(grid), InputError);
  };
  refused([](Grid& g) { g.size.y() = 0; });
  refused([](Grid& g) { g.spacing_mm.z() = -1; });
  refused([](Grid& g) { g.spacing_mm.x() = std::numeric_limits<double>::quiet_NaN(); });
  refused([](Grid& g) { g.direction.col(0) = g.direction.col(1); });
  refused([](Grid& g) { g.origin.lps.x() = std::numeric_limits<double>::infinity(); });
  EXPECT_NO_THROW(Validate(ObliqueGrid()));
}

TEST(GridLines, VisitEveryVoxelOnceAlongTheirAxis) {
  const Grid grid = ObliqueGrid({5, 4, 3});
  for (int axis = 0; axis < 3; ++axis) {
    const GridLines lines(grid, axis);
    std::vector<int> visits(grid.VoxelCount(), 0);
    for (size_t line = 0; line < lines.count; ++line) {
      Eigen::Vector3i p = grid.Ijk(lines.First(line));
      EXPECT_EQ(p[axis], 0);
      for (int n = 0; n < lines.length; ++n, ++p[axis]) {
        const size_t at = lines.First(line) + size_t(n) * lines.stride;
        EXPECT_EQ(grid.Ijk(at), p);
        ++visits[at];
      }
    }
    EXPECT_EQ(visits, std::vector<int>(grid.VoxelCount(), 1));
  }
}

TEST(LinesSideBySide, AreAllLinesOnceOfNeighboursInMemory) {
  const Grid grid = ObliqueGrid({37, 5, 3});  // 37 lines a row along the second axis, 185 along the third
  for (int axis = 1; axis < 3; ++axis) {
    const LinesSideBySide bundles(grid, axis);
    std::vector<int> visits(grid.VoxelCount(), 0);
    for (size_t bundle = 0; bundle < bundles.count; ++bundle) {
      EXPECT_LE(bundles.LinesOf(bundle), LinesSideBySide::kMost);
      for (size_t n = 0; n < bundles.LinesOf(bundle); ++n) {
        const size_t first = bundles.First(bundle) + n;
        EXPECT_EQ(grid.Ijk(first)[axis], 0);
        for (int q = 0; q < bundles.lines.length; ++q) ++visits[first + size_t(q) * bundles.lines.stride];
      }
    }
    EXPECT_EQ(visits, std::vector<int>(grid.VoxelCount(), 1));
    EXPECT_EQ(bundles.count, axis == 1 ? 3u * 3 : 12u);
  }
}

// Of 5 x 4 x 3 voxels 4 x 4 x 3 pairs lie along the first axis, 5 x 3 x 3 along the second, 5 x 4 x 2 along
// the third.
TEST(ForEachPair, VisitsAllThatLieBesideEachOtherOnce) {
  const Grid grid = ObliqueGrid({5, 4, 3});
  std::set<std::pair<size_t, size_t>> seen;
  size_t visits = 0;
  ForEachPair(grid, [&](size_t v, size_t next) {
    EXPECT_EQ((grid.Ijk(next) - grid.Ijk(v)).norm(), 1);
    seen.insert({v, next}), ++visits;
  });
  EXPECT_EQ(visits, 48u + 45u + 40u);
  EXPECT_EQ(seen.size(), visits);
}

}  // namespace
}  // namespace kvx
