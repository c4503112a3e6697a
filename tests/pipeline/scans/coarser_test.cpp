// Means of blocks of a linear ramp are the ramp at the blocks' middles.
#include "pipeline/scans/coarser.h"

#include <gtest/gtest.h>

#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

Grid ObliqueGrid() {
  Grid grid;
  grid.size = {21, 17, 12};
  grid.spacing_mm = {0.7, 0.6, 1.5};
  grid.origin = {{5, -40, 12}};
  grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix();
  return grid;
}

double Ramp(const PointMm& p) { return 3 + p.lps.dot(Eigen::Vector3d(0.3, -0.2, 0.5)); }

TEST(Coarser, MeansOfARampAreTheRampAtTheMiddles) {
  Volume scan(ObliqueGrid());
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    scan.values[v] = float(Ramp(scan.grid.ToMm(p.x(), p.y(), p.z())));
  }
  const Volume means = Coarser(scan, {{{3, 1, 2}, {19, 13, 10}}, {4, 4, 2}});
  EXPECT_EQ(means.grid.size, Eigen::Vector3i(4, 3, 4));
  for (size_t v = 0; v < means.values.size(); ++v) {
    const Eigen::Vector3i p = means.grid.Ijk(v);
    EXPECT_NEAR(means.values[v], Ramp(means.grid.ToMm(p.x(), p.y(), p.z())), 1e-4);
  }
}

TEST(Coarser, TheLastBlocksAreCutShort) {
  Volume scan(ObliqueGrid(), 1.0f);
  scan(20, 16, 11) = 9;
  const BlockedBox all{{{0, 0, 0}, scan.grid.size}, {4, 4, 4}};
  const Volume means = Coarser(scan, all);
  EXPECT_EQ(means.grid.size, Eigen::Vector3i(6, 5, 3));
  EXPECT_NEAR(means(5, 4, 2), (9 + 3) / 4.0, 1e-6);  // 1 x 1 x 4 voxels
  EXPECT_EQ(all.VoxelOf({5, 4, 2}), Eigen::Vector3i(20, 16, 9));
}

TEST(Coarser, TheBonesOwnStrokesAreNeverLost) {
  LabelMap strokes(ObliqueGrid());
  strokes(0, 0, 0) = 7, strokes(1, 0, 0) = 2, strokes(1, 1, 0) = uint16_t(kBackgroundStroke);
  strokes(4, 0, 0) = uint16_t(kBackgroundStroke), strokes(5, 0, 0) = 7;
  const BlockedBox part{{{0, 0, 0}, {8, 2, 1}}, {2, 2, 1}};
  EXPECT_EQ(Coarser(strokes, part, 7).values, (std::vector<uint16_t>{7, 0, 7, 0}));
  EXPECT_EQ(Coarser(strokes, part, 3).values, (std::vector<uint16_t>{2, 0, 7, 0}));
}

TEST(BlocksFor, DoublesShortEdgesUntilFewEnoughBlocksFillTheBox) {
  const Grid grid = ObliqueGrid();
  const VoxelBox all{{0, 0, 0}, grid.size};
  EXPECT_EQ(BlocksFor(all, grid, grid.VoxelCount()).size(), 1u);
  const auto blocks = BlocksFor(all, grid, 800);
  ASSERT_EQ(blocks.size(), 3u);  // 0.7 x 0.6 x 1.5 mm, then 1.4 x 1.2 x 1.5
  EXPECT_EQ(blocks[1], Eigen::Vector3i(2, 2, 1));
  EXPECT_EQ(blocks[2], Eigen::Vector3i(4, 4, 2));
}

}  // namespace
}  // namespace kvx
