// A ball of tissue with a pocket of air inside, in air.
#include "pipeline/bones/images/outer_air.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

constexpr double kBallMm = 20, kPocketMm = 6;

// Grey of tissue at `r` from the middle of the ball, and noise.
Volume Ball(double air, double tissue, double noise) {
  Grid grid;
  grid.size = {56, 56, 56};
  grid.origin.lps = Eigen::Vector3d::Constant(-27.5);
  Volume out(grid);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const double r = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps.norm();
    out.values[v] = float((r < kBallMm && r > kPocketMm ? tissue : air) + normal(random));
  }
  return out;
}

float At(const Volume& volume, const Eigen::Vector3d& mm) {
  return SampleTrilinear(volume, volume.grid.ToVox(PointMm{mm}));
}

TEST(OuterAir, LiesAroundTheBodyAndNotInIt) {
  for (const auto& [air, tissue, modality] :
       {std::tuple{8.0, 120.0, "MR"}, std::tuple{-1000.0, 40.0, "CT"}, std::tuple{8.0, 120.0, ""}}) {
    const Volume outer = OuterAir(Ball(air, tissue, 4), modality, 4.0);
    EXPECT_NEAR(outer.grid.MeanSpacingMm(), 4.0, 1e-9);
    EXPECT_EQ(At(outer, {25, 0, 0}), 1) << modality;
    EXPECT_EQ(At(outer, {-18, 18, 18}), 1) << modality;
    EXPECT_EQ(At(outer, {13, 0, 0}), 0) << modality;
    EXPECT_EQ(At(outer, {0, 0, 0}), 0) << modality << ", the pocket";
  }
}

TEST(OuterAir, IsNowhereWhereNoAirIsSeen) {
  for (const float value : OuterAir(Ball(90, 120, 4), "MR", 4.0).values) EXPECT_EQ(value, 0);
}

}  // namespace
}  // namespace kvx
