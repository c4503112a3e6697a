// A hollow ball with a round window in its shell.
#include "pipeline/segmentation/ct/shell_shapes.h"

#include <gtest/gtest.h>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

constexpr double kLevelHu = 600;

// Radius 10 mm, shell 1.5 mm; through the window, `window_mm` wide, a thin shell of half the density is left,
// or nothing.
struct WindowedBall {
  Volume scan;
  LabelMap parts;

  WindowedBall(double window_mm, float in_window_hu) {
    const Grid grid = testing_support::Cubes({60, 60, 60}, 0.5);
    scan = Volume(grid, 40.0f);
    parts = LabelMap(grid);
    for (size_t v = 0; v < scan.values.size(); ++v) {
      const Eigen::Vector3d mm = FromMiddle(v);
      if (mm.norm() > 10 || mm.norm() < 8.5) continue;
      const bool window = mm.x() > 0 && std::hypot(mm.y(), mm.z()) < window_mm / 2;
      scan.values[v] = window ? in_window_hu : 900.0f;
      parts.values[v] = window ? 0 : 3;
    }
  }
  Eigen::Vector3d FromMiddle(size_t v) const {
    return scan.grid.Ijk(v).cast<double>() * 0.5 - Eigen::Vector3d(14.8, 14.8, 14.8);
  }
  ShellShape Shape() const { return ShapesOfShells(scan, parts, {3}, kLevelHu).at(3); }
  // Calls visit(place from the middle in mm, is marrow, within reach) for every voxel of the box.
  template <class Visit>
  void ForEach(const ShellShape& shape, const Visit& visit) const {
    ForEachVoxel(shape.box, scan.grid, [&](const Eigen::Vector3i&, size_t here, size_t v) {
      visit(FromMiddle(v), shape.marrow.values[here] != 0, shape.reach.values[here] != 0);
    });
  }
};

TEST(ShapesOfShells, MarrowLiesDeepInAShellWithSmallGaps) {
  const WindowedBall ball(3, 40);
  size_t marrow_voxels = 0;
  ball.ForEach(ball.Shape(), [&](const Eigen::Vector3d& mm, bool marrow, bool reach) {
    const double r = mm.norm();
    const bool window = mm.x() >= 5;
    EXPECT_TRUE(marrow || window || r >= 8) << mm.transpose();
    EXPECT_TRUE(!marrow || r < 8.9) << mm.transpose();
    EXPECT_TRUE(reach || window || r >= 9.5) << mm.transpose();
    EXPECT_TRUE(!reach || r < 11.4) << "a voxel or two beyond: " << mm.transpose();
    marrow_voxels += marrow;
  });
  EXPECT_GT(marrow_voxels, 15000u);
}

TEST(ShapesOfShells, WhatIsWideOpenEnclosesNothing) {
  const WindowedBall ball(8, 40);
  ball.ForEach(ball.Shape(), [](const Eigen::Vector3d& mm, bool marrow, bool) {
    EXPECT_TRUE(!marrow || mm.norm() >= 5) << mm.transpose();
  });
}

TEST(ShapesOfShells, AThinShellEnclosesWhereBoneMayBeThoughNotMarrow) {
  const WindowedBall ball(8, 400);
  ball.ForEach(ball.Shape(), [](const Eigen::Vector3d& mm, bool marrow, bool reach) {
    EXPECT_TRUE((reach && !marrow) || mm.norm() >= 5) << mm.transpose();
  });
}

TEST(ShapesOfShells, OnlyOfTheLabelsAskedFor) {
  const WindowedBall ball(3, 40);
  EXPECT_TRUE(ShapesOfShells(ball.scan, ball.parts, {1}, kLevelHu).empty());
}

}  // namespace
}  // namespace kvx
