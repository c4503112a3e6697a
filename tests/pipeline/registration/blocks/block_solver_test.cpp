// Equations written by hand: the step that solves them, and what a block does not know of its place; what a
// step is said to gain, and what the images say then.
#include "pipeline/registration/blocks/block_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "kernels/block_kernels.h"
#include "pipeline/registration/images/usual_residual.h"
#include "tests/support/fixtures.h"

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

// 24 displacements that the images know alike and apart from each other, 50 each.
class OneBlock : public testing::Test {
 protected:
  OneBlock() {
    for (const int pair : {0, 3, 5}) {  // xx, yy, zz
      for (int a = 0; a < kControlPoints; ++a) equations_[size_t(64 * pair + 9 * a)] = 50;
    }
    level_.grid.spacing_mm = {2, 2, 2};
    level_.bending = 1;
  }
  float& Group(size_t group, size_t n) { return equations_[384 + 24 * group + n]; }
  void SetSums(std::array<float, kSumChannels> sums) {
    std::copy(sums.begin(), sums.end(), equations_.end() - kSumChannels);
  }
  BlockStep Solved(double firmness = 0) const {
    return BlockSolver(BlockSpline(), level_).Solve(equations_, firmness);
  }
  BlockLevel level_;
  std::vector<float> equations_ = std::vector<float>(kEquationValues, 0.0f);
};

// f = g / h, and the energy falls by g^2 / 2h.
TEST_F(OneBlock, GoesWhereItIsPulled) {
  Group(0, 9) = -50;  // y of the second control point
  const BlockStep step = Solved();
  for (size_t n = 0; n < 24; ++n) EXPECT_NEAR(step.displacement_mm[n], n == 9 ? 1 : 0, 1e-6) << n;
  EXPECT_NEAR(step.data_gain, 25, 1e-6);
  EXPECT_EQ(step.bending_change, 0);
  EXPECT_NEAR(step.largest_mm, 1, 1e-6);
}

// A step stays below 0.35 of a block's width of eight voxels, and keeps its direction.
TEST_F(OneBlock, StopsWhereItWouldFold) {
  level_.grid.spacing_mm = {2, 1, 3};
  Group(0, 0) = -3000, Group(0, 8) = -4000;
  const BlockStep step = Solved();
  EXPECT_NEAR(step.largest_mm, 0.35 * 8 * 1, 1e-9);
  EXPECT_NEAR(step.displacement_mm[0], 0.6 * 2.8, 1e-6);
  EXPECT_NEAR(step.displacement_mm[8], 0.8 * 2.8, 1e-6);
}

// A gain is 1 to 0.2, which is a weight of 25: (75 + 25) gain = 55 + 25. So the template counts 0.8, and what
// a displacement shares with the gain, 10^2 / 100, it is known less.
TEST_F(OneBlock, AGainExplainsAPart) {
  SetSums({75, 0, 0, 75, 55, 75});
  Group(1, 0) = 10, Group(0, 0) = -41;
  const BlockStep step = Solved();
  EXPECT_NEAR(step.displacement_mm[0], (41 + 10 * 0.8) / (50 - 1), 1e-6);
  EXPECT_NEAR(step.data_gain, 0.5 * 49, 1e-5);
}

// As does a bias, which is known to 0.2 of the template's contrast: (75 + 25) bias = 20.
TEST_F(OneBlock, ABiasExplainsAPart) {
  SetSums({75, 0, 20, 75, 75, 75});
  Group(2, 0) = 10, Group(0, 0) = -47;
  EXPECT_NEAR(Solved().displacement_mm[0], (47 + 10 * 0.2) / (50 - 1), 1e-6);
  level_.weight = {1, 1, 0}, level_.intensity = {3, 7, 99};  // contrast 2: (75 + 25 / 4) bias = 20
  EXPECT_NEAR(Solved().displacement_mm[0], (47 + 200 / 81.25) / (50 - 100 / 81.25), 1e-6);
}

// What the field is bent by already pulls back: f = (50 - 25) / 50, at a cost of f times the force.
TEST_F(OneBlock, AFieldThatIsBentPullsBack) {
  Group(0, 0) = -50, Group(3, 0) = 25;
  const BlockStep step = Solved();
  EXPECT_NEAR(step.displacement_mm[0], 0.5, 1e-6);
  EXPECT_NEAR(step.bending_change, 0.5 * 25, 1e-6);
  EXPECT_NEAR(step.data_gain, 0.5 * 50 - 0.5 * 50 * 0.25, 1e-6);
}

// (h + prior) f = g, where the prior is the spline's energy in the ball's coordinates: bending per squared
// laplacian over the ball's radius, times the firmness.
TEST_F(OneBlock, BendsAsFarAsThePriorLets) {
  Group(0, 2) = -50;
  const double radius_mm = 12 * 2, firmness = 3;
  level_.bending = 40;
  const ControlMatrix prior = firmness * level_.bending / radius_mm * BlockSpline().BendingEnergy();
  const BlockStep step = Solved(firmness);
  Eigen::Matrix<double, kControlPoints, 1> f;
  for (int a = 0; a < kControlPoints; ++a) f[a] = step.displacement_mm[size_t(a)];
  EXPECT_GT(f[2], 0);
  EXPECT_LT(f[2], 0.98);
  for (int a = 0; a < kControlPoints; ++a)
    EXPECT_NEAR(50 * f[a] + prior.row(a).dot(f), a == 2 ? 50 : 0, 1e-3) << a;
  EXPECT_NEAR(step.bending_change, 0.5 * f.dot(prior * f), 1e-4);
}

// Of images without anything in them, on which all counts.
BlockLevel Flat(const Eigen::Vector3d& spacing_mm) {
  BlockLevel level;
  level.grid.size = {48, 48, 48};
  level.grid.spacing_mm = spacing_mm;
  level.scan = Volume(level.grid, 0.0f);
  const size_t voxels = level.grid.VoxelCount();
  for (size_t v = 0; v < voxels; ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    level.start.push_back({float(p.x()), float(p.y()), float(p.z()), 0});
  }
  level.intensity.assign(voxels, 0), level.weight.assign(voxels, 1), level.mobility.assign(voxels, 1);
  level.stiffness.assign(voxels / 8, 1), level.firmness.assign(voxels / 8, 1);
  for (size_t c = 0; c < voxels / 8; ++c)
    level.active.push_back(cl_int(c)), level.visible.push_back(cl_int(c));
  level.bending = 1;
  return level;
}

// There the prior alone pulls, and each visit must bring the block nearer to rest.
TEST(BlockSolver, ABendInNothingDiesDownHoweverLongTheVoxels) {
  for (const Eigen::Vector3d& spacing_mm : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.3, 0.3, 1)}) {
    const BlockLevel level = Flat(spacing_mm);
    const BlockSolver solver(BlockSpline(), level);
    BlockKernels kernels(testing_support::SharedBackend(), level, MakeBallBasis(BlockSpline()),
                         std::vector<FieldVector>(level.grid.VoxelCount(), FieldVector::Zero()));
    const std::vector<cl_int4> blocks = {{{12, 12, 12, 0}}};
    std::vector<float> steps(24, 0.0f);
    for (size_t a = 0; a < kControlPoints; ++a) steps[a] = a % 2 ? 0.03f : -0.03f;
    float before = 1;
    for (int visit = 0; visit < 6; ++visit) {
      kernels.Linearise();
      if (visit > 0) {
        const BlockStep step = solver.Solve(kernels.Equations(blocks), 1);
        steps.assign(step.displacement_mm.begin(), step.displacement_mm.end());
      }
      kernels.AddSteps(blocks, steps);
      kernels.Accept();
      float largest = 0;
      for (const FieldVector& d : kernels.Field()) largest = std::max(largest, d.norm());
      EXPECT_LT(largest, before) << spacing_mm.transpose() << ", visit " << visit;
      before = largest;
    }
  }
}

// Both images show a ramp, and the template besides what no difference over two or four voxels sees: more in
// every other voxel, where tissue moves three times as easily, and as much less in those between. No gain and
// no bias says that. Under a firm prior a step is short, and gains by the slope of the squares. Of what moves
// half a hundredth lies around the ball, where they are not summed.
TEST(BlockSolver, OfASmallStepTheGainIsWhatSquaresFallByWithTheirBestGainAndBias) {
  BlockLevel level = Flat({1, 1.2, 0.8});
  for (size_t v = 0; v < level.intensity.size(); ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    const bool odd = p.sum() % 2 != 0;
    level.scan.values[v] = 0.1f * float(p.x() - 14) - 0.06f * float(p.y() - 24) + 0.08f * float(p.z() - 24);
    level.intensity[v] = level.scan.values[v] + (odd ? 0.5f : -0.5f);
    level.mobility[v] = odd ? 0.9f : 0.3f;
  }
  const BlockSolver solver(BlockSpline(), level);
  BlockKernels kernels(testing_support::SharedBackend(), level, MakeBallBasis(BlockSpline()),
                       std::vector<FieldVector>(level.grid.VoxelCount(), FieldVector::Zero()));
  const std::vector<cl_int4> blocks = {{{12, 12, 12, 0}}};
  kernels.Linearise();
  const BlockStep step = solver.Solve(kernels.Equations(blocks), 5);
  kernels.AddSteps(blocks, step.displacement_mm);
  kernels.Try();
  const auto energy = [&](BlockKernels::State state) {
    const std::vector<float> sums = kernels.Sums(blocks, state);
    return double(sums[0]) * solver.DataEnergyPerWeight(sums);
  };
  const double before = energy(BlockKernels::State::kField), after = energy(BlockKernels::State::kTrial);
  EXPECT_LT(step.largest_mm, 0.6);
  EXPECT_NEAR((before - after) / step.data_gain, 1, 0.01);
}

// The scale of stated errors was read from voxels that are nearly cubes.
TEST(BlockSolver, StatedErrorsGoByTheVoxelsVolume) {
  std::array<float, kControlPoints> middle;
  middle.fill(1.0f / kControlPoints);
  const auto variance = [&](const Eigen::Vector3d& spacing_mm) {
    BlockLevel level;
    level.grid.spacing_mm = spacing_mm;
    level.bending = 100;
    return BlockSolver(BlockSpline(), level).VariancesMm2(Equations(100), 1, {&middle, 1}).at(0);
  };
  EXPECT_FLOAT_EQ(variance({1, 1, 8}), variance({2, 2, 2}));
}

}  // namespace
}  // namespace kvx
