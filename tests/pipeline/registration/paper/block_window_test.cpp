// Mismatch in closed form; the cost of a block; a small planted motion found by the simplex.
#include "pipeline/registration/paper/block_window.h"

#include <gtest/gtest.h>

#include "pipeline/registration/paper/block_optimiser.h"

namespace kvx {
namespace {

TEST(PaperMismatch, SquaresByHand) {
  const std::vector<float> a{10, 20, 30}, b{13, 20, 26};
  EXPECT_NEAR(Mismatch(false, a, b), std::sqrt(25.0 / 3), 1e-6);
  EXPECT_EQ(Mismatch(false, a, a), 0);
}

// A binary symmetric channel: MI = ln 2 - H(e), both marginals ln 2. 0 and 255 are bin centres, so nothing
// spreads.
TEST(PaperMismatch, NormalisedInformationOfABinaryChannel) {
  const int count = 1000, flipped = 100;
  std::vector<float> sent, received;
  for (int n = 0; n < 2 * count; ++n) {
    const bool one = n >= count, flip = n % count < flipped;
    sent.push_back(one ? 255.0f : 0.0f);
    received.push_back(one != flip ? 255.0f : 0.0f);
  }
  const double e = double(flipped) / count;
  const double lost = -(e * std::log(e) + (1 - e) * std::log(1 - e)) / std::log(2.0);
  EXPECT_NEAR(Mismatch(true, received, sent), lost, 1e-9);
  std::vector<float> inverted;
  for (const float value : sent) inverted.push_back(255 - value);
  EXPECT_NEAR(Mismatch(true, inverted, sent), 0, 1e-9) << "any functional relation is no mismatch";
  EXPECT_NEAR(Mismatch(true, std::vector<float>(sent.size(), 9.0f), sent), 0, 1e-9)
      << "nothing to see is no mismatch";
}

constexpr int kSize = 3 * kBlockVoxels;
const BlockIndex kMiddle(1, 1, 1);
const Eigen::Vector3d kPlanted(0.8, -0.6, 0.5);  // voxels, of all eight control points

double Texture(const Eigen::Vector3d& p) {
  return 128 + 50 * std::sin(0.7 * p.x() + 0.3 * p.y()) * std::cos(0.5 * p.y() - 0.4 * p.z()) +
         40 * std::sin(0.6 * p.z());
}

PaperLevel PlantedLevel(int number) {
  Grid grid;
  grid.size = Eigen::Vector3i::Constant(kSize);
  PaperLevel level{number, 1 << (5 - number), Volume(grid), Volume(grid), Mask(grid, 1), Mask(grid)};
  const BlockSpline spline;
  const Eigen::Vector3d centre = Eigen::Vector3d::Constant((kSize - 1) / 2.0);
  for (size_t v = 0; v < level.source.values.size(); ++v) {
    const Eigen::Vector3d p = grid.Ijk(v).cast<double>();
    const double share = spline.Basis((p - centre) / (kSize / 2.0)).sum();
    level.source.values[v] = float(Texture(p));
    level.target.values[v] = float(Texture(p + share * kPlanted));
  }
  return level;
}

std::vector<double> Planted() {
  std::vector<double> out;
  for (int axis = 0; axis < 3; ++axis) out.insert(out.end(), kControlPoints, kPlanted[axis]);
  return out;
}

TEST(BlockWindow, RestCostsTheMismatchAndTheTruthHardlyAnything) {
  for (const int number : {3, 5}) {  // by information, by squares
    const PaperLevel level = PlantedLevel(number);
    const BlockWindow window(level, level.source, kMiddle);
    ASSERT_EQ(window.parameters(), 24);
    const double rest = window.Cost(std::vector<double>(24, 0.0));
    EXPECT_NEAR(rest, Mismatch(level.by_information(), level.target.values, level.source.values), 1e-9);
    EXPECT_LT(window.Cost(Planted()), (number == 5 ? 0.35 : 0.9) * rest);
  }
}

TEST(BlockWindow, StepsAreComposed) {
  const PaperLevel level = PlantedLevel(5);
  const BlockWindow window(level, level.source, kMiddle);
  VoxelShifts shifts(level.source.grid, Eigen::Vector3f(0.25f, 0, 0));  // constant: D(p + u) is known
  const std::vector<size_t> changed = window.Compose(Planted(), shifts);
  EXPECT_GT(changed.size(), 0u);
  const Eigen::Vector3d corner =
      Eigen::Vector3d::Constant((kSize - 1) / 2.0) + kSize / 2.0 * BlockSpline().control_points()[7];
  const Eigen::Vector3d there = SampleTrilinear(shifts, PointVox{corner});
  EXPECT_LT((there - kPlanted - Eigen::Vector3d(0.25, 0, 0)).norm(), 0.1);
  EXPECT_EQ(shifts(0, 0, 0), Eigen::Vector3f(0.25f, 0, 0)) << "nothing moves outside the ball";
}

TEST(OptimiseBlock, RecoversASmallPlantedMotionTheSameWayTwice) {
  const PaperLevel level = PlantedLevel(5);
  const BlockWindow window(level, level.source, kMiddle);
  const BlockOptimum found = OptimiseBlock(window, 7);
  ASSERT_EQ(found.displacements.size(), 24u);
  const double rest = window.Cost(std::vector<double>(24, 0.0));
  EXPECT_LT(window.Cost(found.displacements), 0.4 * rest);
  EXPECT_NEAR(rest - window.Cost(found.displacements), found.gain, 1e-9);
  VoxelShifts shifts(level.source.grid, Eigen::Vector3f::Zero());
  window.Compose(found.displacements, shifts);
  const PointVox middle{Eigen::Vector3d::Constant((kSize - 1) / 2.0)};
  EXPECT_LT((SampleTrilinear(shifts, middle) - kPlanted).norm(), 0.5 * kPlanted.norm());
  EXPECT_EQ(OptimiseBlock(window, 7).displacements, found.displacements);
}

TEST(BlockWindow, ABlockInBoneHasNothingToMove) {
  PaperLevel level = PlantedLevel(5);
  level.bone = Mask(level.source.grid, 1);
  const BlockWindow window(level, level.source, kMiddle);
  EXPECT_EQ(window.parameters(), 0);
  EXPECT_TRUE(OptimiseBlock(window, 1).displacements.empty());
}

}  // namespace
}  // namespace kvx
