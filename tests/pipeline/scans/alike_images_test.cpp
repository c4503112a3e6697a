// Slices across each other, against boxes and waves whose blur is known on paper.
#include "pipeline/scans/alike_images.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/plain_grid.h"
#include "tests/support/waves.h"

namespace kvx {
namespace {
using namespace testing_support;

Grid GridOf(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm) {
  return PlainGrid(size, spacing_mm,
                   -0.5 * (size.cast<double>().array() - 1).matrix().cwiseProduct(spacing_mm));
}

const RigidTransform kQuarterTurn{
    Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitX())), {5, 6, 7}};

TEST(Liken, ParallelSlicesAndCubesStayAsTheyAre) {
  const Grid cubes = GridOf({9, 9, 9}, {1, 1, 1.2}), wide = GridOf({9, 9, 9}, {2, 2, 2.4}),
             slices = GridOf({9, 9, 9}, {1, 1, 4});
  for (const auto& [a, b] : {std::pair(cubes, wide), std::pair(wide, cubes), std::pair(slices, slices)}) {
    const Likening alike = LikenThickSlices(a, b, {});
    EXPECT_LT(alike.a_sd_mm.norm() + alike.b_sd_mm.norm(), 1e-6);
    EXPECT_NEAR(alike.voxel_mm3, std::max(a.spacing_mm.prod(), b.spacing_mm.prod()), 1e-9);
  }
}

TEST(Liken, SlicesAcrossEachOtherBlurEachByTheOther) {
  const Grid slices = GridOf({9, 9, 9}, {1, 1, 4});
  const Likening alike = Liken(slices, slices, kQuarterTurn);  // b's z lies along a's y
  const Eigen::Matrix3d a_mm2 = alike.a_sd_mm * alike.a_sd_mm.transpose(),
                        b_mm2 = alike.b_sd_mm * alike.b_sd_mm.transpose();
  const Eigen::Vector3d along_y(0, (16.0 - 1) / 12, 0);
  EXPECT_LT((a_mm2 - Eigen::Matrix3d(along_y.asDiagonal())).norm(), 1e-9);
  EXPECT_LT((b_mm2 - Eigen::Matrix3d(along_y.asDiagonal())).norm(), 1e-9);
  EXPECT_NEAR(alike.voxel_mm3, 1 * 4 * 4, 1e-9);
}

TEST(Liken, WiderVoxelsBlurNarrowerOnesAlongEveryAxis) {
  const Likening alike = Liken(GridOf({9, 9, 9}, {1, 1, 1}), GridOf({9, 9, 9}, {2, 2, 2}), kQuarterTurn);
  EXPECT_LT((alike.a_sd_mm * alike.a_sd_mm.transpose() - 0.25 * Eigen::Matrix3d::Identity()).norm(), 1e-9);
  EXPECT_LT(alike.b_sd_mm.norm(), 1e-9);
  EXPECT_NEAR(alike.voxel_mm3, 8, 1e-9);
}

TEST(Liken, OnlyTheSharperOfTwoIsBlurred) {
  const Likening alike = Liken(GridOf({9, 9, 9}, {1, 1, 1}), GridOf({9, 9, 9}, {1, 1, 4}), {});
  const Eigen::Vector3d along_z(0, 0, (16.0 - 1) / 12);
  EXPECT_LT((alike.a_sd_mm * alike.a_sd_mm.transpose() - Eigen::Matrix3d(along_z.asDiagonal())).norm(), 1e-9);
  EXPECT_LT(alike.b_sd_mm.norm(), 1e-9);
  EXPECT_NEAR(alike.voxel_mm3, 4, 1e-9);
}

TEST(Liken, NeverBlursMoreThanItMayAtMost) {
  const Grid slices = GridOf({9, 9, 9}, {1, 1, 4}), cubes = GridOf({9, 9, 9}, {2, 2, 2});
  EXPECT_NEAR(MostBlurSdMm(slices, cubes), std::sqrt(12.0 / 12), 1e-12);
  EXPECT_NEAR(MostBlurSdMm(cubes, slices), std::sqrt(12.0 / 12), 1e-12);
  EXPECT_NEAR(MostBlurSdMm(slices, slices), std::sqrt(15.0 / 12), 1e-12);
  EXPECT_EQ(MostBlurSdMm(cubes, cubes), 0);
  EXPECT_NEAR(Liken(slices, slices, kQuarterTurn).a_sd_mm.norm(), MostBlurSdMm(slices, slices), 1e-9);
}

TEST(BlurTaps, HaveTheVarianceHoweverFarTheyReach) {
  const Grid grid = GridOf({9, 9, 9}, {1, 2, 3});
  Eigen::Matrix3d sd_mm = Eigen::Matrix3d::Zero();
  sd_mm.col(0) = Eigen::Vector3d(0.3, 0.4, 0);
  sd_mm.col(1) = Eigen::Vector3d(0, 0, 2.4);
  sd_mm.col(2) = Eigen::Vector3d(0.01, 0, 0);  // too little to show
  for (const double reach_voxels : {0.0, 1.0, 2.5}) {
    const std::vector<BlurTap> taps = BlurTaps(grid, sd_mm, 0.1, reach_voxels);
    EXPECT_EQ(taps.size(), 9);
    double whole = 0;
    Eigen::Matrix3d variance_mm2 = Eigen::Matrix3d::Zero();
    for (const BlurTap& tap : taps) {
      const Eigen::Vector3d away_mm = tap.away_voxels.cwiseProduct(grid.spacing_mm);
      whole += tap.weight, variance_mm2 += tap.weight * away_mm * away_mm.transpose();
      EXPECT_TRUE(tap.away_voxels.isZero() || tap.away_voxels.norm() >= reach_voxels - 1e-9);
    }
    EXPECT_NEAR(whole, 1, 1e-12);
    EXPECT_LT((variance_mm2 - sd_mm.leftCols<2>() * sd_mm.leftCols<2>().transpose()).norm(), 1e-12);
  }
}

TEST(BlurredImage, AWaveIsBlurredAsThickSlicesWould) {
  constexpr double kPerMm = 0.5;
  const Volume wave = Wave(GridOf({9, 9, 61}, {1, 1, 1}), {0, 0, kPerMm});
  const CubicImage image(wave);
  const BlurredImage blurred(image, Liken(wave.grid, GridOf({9, 9, 9}, {1, 1, 4}), {}).a_sd_mm);
  ASSERT_TRUE(blurred.blurs());
  const double amplitude =
      50 * LeftByBox(kPerMm, 4) / LeftByBox(kPerMm, 1);  // the wave has been sampled by voxels
  for (const double z : {0.0, 0.7, 1.9, 4.4}) {
    double value;
    Eigen::Vector3d slope;
    ASSERT_TRUE(blurred.At(wave.grid.ToVox(PointMm{{0, 0, z}}).ijk, value, slope));
    EXPECT_NEAR(value, 100 + amplitude * std::cos(kPerMm * z), 0.5);
    EXPECT_NEAR(slope.z(), -kPerMm * amplitude * std::sin(kPerMm * z), 0.3);
  }
  double value;
  Eigen::Vector3d slope;
  EXPECT_TRUE(blurred.At({4, 4, 0}, value, slope));
  EXPECT_FALSE(blurred.At({4, 4, -0.01}, value, slope));
}

TEST(CubicImage, MissesEdgesBetweenThickSlicesOnly) {
  const auto step = [](const Grid& grid) {
    Volume out(grid);
    for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = grid.Ijk(v).z() < 8 ? 10.0f : 50.0f;
    return CubicImage(out);
  };
  const CubicImage thick = step(GridOf({4, 4, 16}, {1, 1, 3}));
  // The square of what (9 (10 + 50) - (10 + 50)) / 16 = 30 misses of 10 and of 50.
  EXPECT_NEAR(thick.MissedVariance({2, 2, 7}), 20 * 20, 1e-3);
  EXPECT_NEAR(thick.MissedVariance({2, 2, 7.5}), 20 * 20, 1e-3);
  EXPECT_NEAR(thick.MissedVariance({2, 2, 3}), 0, 1e-6);
  EXPECT_EQ(step(GridOf({4, 4, 16}, {1, 1, 1.3})).MissedVariance({2, 2, 7}), 0);
}

}  // namespace
}  // namespace kvx
