// Voxels numbered in memory, found again at their places.
#include "core/voxels/axes_order.h"

#include <gtest/gtest.h>

#include "tests/support/turned_grid.h"

namespace kvx {
namespace {

using testing_support::kTurns;
using testing_support::Turned;

Grid Oblique() {
  Grid grid;
  grid.size = {5, 3, 4};
  grid.spacing_mm = {0.7, 1.9, 1.1};
  grid.origin.lps = {31, -7, 112};
  grid.direction = Eigen::AngleAxisd(0.3, Eigen::Vector3d(2, 1, -1).normalized()).toRotationMatrix() *
                   Eigen::Vector3d(-1, -1, 1).asDiagonal();
  return grid;
}

TEST(InOrderOf, KeepsEveryVoxelAtItsPlace) {
  const Grid grid = Oblique();
  LabelMap numbers(grid);
  for (size_t v = 0; v < numbers.values.size(); ++v) numbers.values[v] = uint16_t(v);
  for (const auto& turn : kTurns) {
    const LabelMap turned = InOrderOf(Turned(grid, turn), numbers);
    for (size_t v = 0; v < turned.values.size(); ++v) {
      const Eigen::Vector3i p = turned.grid.Ijk(v);
      const Eigen::Vector3d at = grid.ToVox(turned.grid.ToMm(p.x(), p.y(), p.z())).ijk;
      EXPECT_LT((at - grid.Ijk(turned.values[v]).cast<double>()).norm(), 1e-9);
    }
    EXPECT_EQ(InOrderOf(grid, turned).values, numbers.values);
  }
}

TEST(InOrderOf, TakesASlice) {
  Grid grid = Oblique();
  grid.size.z() = 1;
  LabelMap numbers(grid);
  for (size_t v = 0; v < numbers.values.size(); ++v) numbers.values[v] = uint16_t(v);
  for (const auto& turn : kTurns)
    EXPECT_EQ(InOrderOf(grid, InOrderOf(Turned(grid, turn), numbers)).values, numbers.values);
}

TEST(RightFrontUp, IsTheSameHoweverTheGridIsStored) {
  const Grid grid = Oblique();
  EXPECT_TRUE(RightFrontUp(grid) == grid) << "it runs so already";
  for (const auto& turn : kTurns) EXPECT_TRUE(RightFrontUp(Turned(grid, turn)) == grid);
}

TEST(RightFrontUp, OfThePatientsAxesRunsAgainstLeftAndBack) {
  Grid grid;
  grid.size = {5, 6, 7};
  const Grid out = RightFrontUp(grid);
  EXPECT_TRUE(out.direction.isApprox(Eigen::Matrix3d(Eigen::Vector3d(-1, -1, 1).asDiagonal())));
  EXPECT_TRUE(out.origin.lps.isApprox(Eigen::Vector3d(4, 5, 0)));
}

}  // namespace
}  // namespace kvx
