// Limits that can be worked out by hand, and bounds held against drawn errors.
#include "pipeline/skeleton/bone_certainty.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

// A rod along x: 40 mm long, 10 mm thick.
const Bone kRod{.label = 1,
                .name = "rod",
                .voxels = 500,
                .box = {.axes = Eigen::Matrix3d::Identity(), .extent_mm = {40, 10, 10}}};

BoneFit Known(const Eigen::Vector3d& turn_sd_deg, double shift_sd_mm) {
  BoneFit fit;
  fit.covariance.diagonal().head<3>() = (RadFromDeg(1) * turn_sd_deg).cwiseAbs2();
  fit.covariance.diagonal().tail<3>().setConstant(shift_sd_mm * shift_sd_mm);
  return fit;
}

BoneFit Twisted(double sd_deg) { return Known({sd_deg, 0.01, 0.01}, 0.01); }

TEST(BoneCertainty, GoesByTheTurnOfALargeBone) {
  EXPECT_EQ(CertaintyOf(kRod, Twisted(0.49), 2), Certainty::kSure);  // 3 x 0.5 = 1.5 degrees
  EXPECT_EQ(CertaintyOf(kRod, Twisted(0.51), 2), Certainty::kCoarse);
  EXPECT_EQ(CertaintyOf(kRod, Twisted(0.90), 2), Certainty::kCoarse);  // 1.5 / 1.645 = 0.912
  EXPECT_EQ(CertaintyOf(kRod, Twisted(0.92), 2), Certainty::kUncertain);
  BoneFit lost = Twisted(0.1);
  lost.doubt = Doubt::kBone;
  EXPECT_EQ(CertaintyOf(kRod, lost, 2), Certainty::kDoubtful) << "whatever its spread";
}

TEST(BoneCertainty, GoesByTheSurfaceOfASmallBone) {
  Bone small = kRod;
  small.voxels = 299;
  // About its length the surface is 5 mm away, about its width 20 mm; half a voxel is 0.5 mm.
  EXPECT_EQ(CertaintyOf(small, Twisted(0.49), 1), Certainty::kSure);
  EXPECT_EQ(CertaintyOf(small, Twisted(1.85), 1), Certainty::kCoarse)
      << "0.162 mm three times, but 5.6 degrees";
  EXPECT_EQ(CertaintyOf(small, Twisted(2.0), 1), Certainty::kCoarse);
  EXPECT_EQ(CertaintyOf(small, Known({0, 0.47, 0}, 0), 1), Certainty::kSure);
  EXPECT_EQ(CertaintyOf(small, Known({0, 0.50, 0}, 0), 1), Certainty::kCoarse);
  EXPECT_EQ(CertaintyOf(small, Known({0, 0.90, 0}, 0), 1), Certainty::kUncertain);  // 0.314 mm, 1.6 times
}

TEST(BoneCertainty, GoesByThePlaceToo) {
  EXPECT_EQ(CertaintyOf(kRod, Known({0.1, 0.1, 0.1}, 0.09), 1), Certainty::kSure);  // 0.156 mm in all
  EXPECT_EQ(CertaintyOf(kRod, Known({0.1, 0.1, 0.1}, 0.10), 1), Certainty::kCoarse);
  EXPECT_EQ(CertaintyOf(kRod, Known({0.1, 0.1, 0.1}, 0.18), 1), Certainty::kUncertain);
}

TEST(BoneCertainty, NothingIsTurnedByMoreThanHalfATurn) {
  EXPECT_NEAR(BoundsOf(kRod, Known({90, 90, 90}, 40)).turn_rad, kPi, 1e-12);
}

TEST(BoneCertainty, NineteenOfTwentyDrawnErrorsLieWithinTheBounds) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  for (const Eigen::Vector3d& sd_deg : {Eigen::Vector3d(1, 0.1, 0.1), Eigen::Vector3d(0.7, 0.7, 0.7)}) {
    const PoseBounds bounds = BoundsOf(kRod, Known(sd_deg, 0.05));
    const int draws = 20000;
    int turned = 0, moved = 0;
    for (int n = 0; n < draws; ++n) {
      Eigen::Vector3d turn, shift;
      for (int a = 0; a < 3; ++a)
        turn[a] = RadFromDeg(sd_deg[a]) * normal(random), shift[a] = 0.05 * normal(random);
      turned += turn.norm() <= bounds.turn_rad;
      moved += (turn.cross(Eigen::Vector3d(20, 0, 0)) + shift).norm() <= bounds.surface_mm;
    }
    EXPECT_GT(turned, 0.95 * draws);
    EXPECT_GT(moved, 0.95 * draws);
  }
}

// Errors L z, with z of unit variance and independent: their mean square at a place is the sum over the
// columns of L. Turns and shifts go together here, so that one side of the bone is surer than the other.
TEST(BoneCertainty, ATurnAndAShiftThatGoTogetherAddUpOnOneSideAndCancelOnTheOther) {
  Eigen::Matrix<double, 6, 6> root = 0.01 * Eigen::Matrix<double, 6, 6>::Identity();
  root.col(1).tail<3>() << 0.02, -0.01, 0.15;
  root.col(2).tail<3>() << -0.03, -0.2, 0.01;
  BoneFit fit;
  fit.covariance = root * root.transpose();
  const Eigen::Vector3d along(20, 3, -4);
  for (const Eigen::Vector3d& r : {along, Eigen::Vector3d(-along)}) {
    double mean_square = 0;
    for (const auto& error : root.colwise()) {
      const Eigen::Vector3d turn = error.head<3>(), shift = error.tail<3>();
      mean_square += (turn.cross(r) + shift).squaredNorm();
    }
    EXPECT_NEAR(PlaceVarianceMm2(fit, r), mean_square, 1e-12);
  }
  EXPECT_GT(PlaceVarianceMm2(fit, -along), 3 * PlaceVarianceMm2(fit, along));
}

}  // namespace
}  // namespace kvx
