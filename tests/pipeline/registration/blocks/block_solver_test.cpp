// Equations written by hand: what a block does not know of its place.
#include "pipeline/registration/blocks/block_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "pipeline/registration/images/usual_residual.h"

namespace kvx {
namespace {

// Of a block whose 24 displacements are known alike and apart from each other. `scan_squares`: sum of squares
// of the scan; 100, as of the template, where the images agree.
std::vector<float> Equations(float scan_squares) {
  std::vector<float> equations(kEquationValues, 0.0f);
  for (const int pair : {0, 3, 5}) {  // xx, yy, zz
    for (int a = 0; a < kControlPoints; ++a) equations[size_t(64 * pair + 9 * a)] = 50;
  }
  const float weight = 100, template_squares = 100, products = 100;
  const float sums[kSumChannels] = {weight, 0, 0, template_squares, products, scan_squares};
  std::copy(std::begin(sums), std::end(sums), equations.end() - kSumChannels);
  return equations;
}

// What remains after the best gain, 5, 40 and 80 in all, is 0.05, 0.4 and 0.8 per weight.
TEST(BlockSolver, WhatTheImagesDisagreeInCountsAsUncertainty) {
  BlockLevel level;
  level.grid.spacing_mm = {2, 2, 2};
  level.bending = 1;
  const BlockSolver solver(BlockSpline(), level);
  std::array<float, kControlPoints> middle;
  middle.fill(1.0f / kControlPoints);
  const auto variance = [&](float scan_squares) {
    return solver.VariancesMm2(Equations(scan_squares), 1, {&middle, 1}).at(0);
  };
  const float usual = variance(100);
  EXPECT_GT(usual, 0);
  EXPECT_FLOAT_EQ(variance(105), usual) << "well registered tissue shows as much";
  EXPECT_NEAR(variance(140) / usual, 0.4 / kUsualResidual, 1e-4);
  EXPECT_NEAR(variance(180) / usual, 0.8 / kUsualResidual, 1e-4);
}

}  // namespace
}  // namespace kvx
