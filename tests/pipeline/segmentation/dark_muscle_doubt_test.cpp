// A ball of marrow in thin cortex with a dark middle, in muscle.
#include <gtest/gtest.h>

#include <random>

#include "pipeline/segmentation/grow_bones.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

constexpr double kMarrow = 160, kCortex = 15, kMiddle = 85;

GrownBones BonesWhereMuscleHas(double grey) {
  const Grid grid = testing_support::Cubes({40, 40, 40}, 1.5);
  Volume scan(grid);
  LabelMap strokes(grid);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 4);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v) - Eigen::Vector3i(20, 20, 20);
    const double r = p.cast<double>().norm();
    const double tissue = p.y() < -17 ? 0 : r > 10 ? grey : r > 9 ? kCortex : r > 6 ? kMarrow : kMiddle;
    scan.values[v] = float(std::abs(tissue + noise(random)));
    const bool line = p.x() % 4 == 0 && p.z() % 4 == 0;
    if (line && r < 8) strokes.values[v] = 1;
    if (line && r > 12 && p.y() > -15) strokes.values[v] = kBackgroundStroke;
  }
  return GrowBones(scan, strokes, false, {});
}

TEST(GrowBones, WhatIsDarkInsideIsLessSureWhereMuscleIsDarkToo) {
  const GrownBones usual = BonesWhereMuscleHas(85), dark = BonesWhereMuscleHas(30);
  EXPECT_GT(usual.expected_dice.at(1), 0.98);
  EXPECT_LT(dark.expected_dice.at(1), usual.expected_dice.at(1) - 0.03);
}

}  // namespace
}  // namespace kvx
