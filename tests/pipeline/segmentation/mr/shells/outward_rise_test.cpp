// A dark box in a bright scan: what is on either side of every face is known.
#include "pipeline/segmentation/mr/shells/outward_rise.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr double kLevel = 200;

Grid Cube(int edge) {
  Grid grid;
  grid.size = {edge, edge, edge};
  return grid;
}

// Bright 160, a dark shell 120 at distance 3 (by the largest coordinate) from the middle of 15 voxels.
Volume DarkShell() {
  Volume scan(Cube(15), 160.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    if ((scan.grid.Ijk(v).array() - 7).abs().maxCoeff() == 3) scan.values[v] = 120;
  }
  return scan;
}

double RiseOfBox(const Volume& scan, int radius) {
  const VoxelBox box{Eigen::Vector3i::Constant(1), Eigen::Vector3i::Constant(14)};
  Mask mask(GridOf(box, scan.grid));
  for (size_t v = 0; v < mask.values.size(); ++v)
    mask.values[v] = (mask.grid.Ijk(v).array() - 6).abs().maxCoeff() <= radius;
  return OutwardRise(scan, kLevel, box, mask);
}

TEST(OutwardRise, IsTheContrastOnTheOuterSideOfTheShellOnly) {
  const Volume scan = DarkShell();
  EXPECT_NEAR(RiseOfBox(scan, 3), 0.2, 1e-6);
  EXPECT_NEAR(RiseOfBox(scan, 2), -0.2, 1e-6);
  EXPECT_NEAR(RiseOfBox(scan, 5), 0.0, 1e-6);
}

TEST(OutwardRise, AFaceSaysNoMoreThanItsShareAndNothingIsWorst) {
  Volume scan(Cube(15), 2000.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    if ((scan.grid.Ijk(v).array() - 7).abs().maxCoeff() <= 3) scan.values[v] = 0;
  }
  EXPECT_NEAR(RiseOfBox(scan, 3), 0.3, 1e-6);
  EXPECT_EQ(RiseOfBox(scan, -1), -1.0);
}

TEST(OutwardRise, AFaceAtTheBorderOfTheScanDoesNotCount) {
  Volume scan(Cube(4), 100.0f);
  const VoxelBox box{Eigen::Vector3i::Zero(), Eigen::Vector3i(2, 4, 4)};
  for (size_t v = 0; v < scan.values.size(); ++v) {
    if (scan.grid.Ijk(v).x() < 2) scan.values[v] = 80;
  }
  EXPECT_NEAR(OutwardRise(scan, kLevel, box, Mask(GridOf(box, scan.grid), 1)), 0.1, 1e-6);
}

// A block of 2 x 4 x 4 voxels: of its 64 faces the 16 of one side get no brighter.
TEST(ShareUnclear, CountsFacesThatGetHardlyBrighter) {
  Volume scan(Cube(10), 100.0f);
  const VoxelBox box{{3, 3, 3}, {5, 7, 7}};
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    if (box.Contains(p) || p.x() < 3) scan.values[v] = 80;
  }
  EXPECT_DOUBLE_EQ(ShareUnclear(scan, kLevel, box, Mask(GridOf(box, scan.grid), 1)), 16.0 / 64);
  EXPECT_DOUBLE_EQ(ShareUnclear(scan, kLevel, box, Mask(GridOf(box, scan.grid), 0)), 0);
}

}  // namespace
}  // namespace kvx
