// Equation 2 and its guard.
#include "core/blend.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

const PoseVector kPose = {Exp((Twist() << 0.1, -0.2, 0.3, 1, 2, 3).finished()),
                          Exp((Twist() << -0.3, 0.1, 0.2, -4, 1, 0).finished())};
const Eigen::Vector3d kPoint(10, -20, 30);

VoxelWeights Two(float first) { return {{0, 1, 0, 0}, {first, 1 - first, 0, 0}}; }

TEST(Blend, OneBoneIsItsOwnMotion) {
  const VoxelWeights rigid{{1, 1, 1, 1}, {1, 0, 0, 0}};
  EXPECT_TRUE(Apply(Blend(rigid, kPose), kPoint).isApprox((kPose[1] * PointMm{kPoint}).lps, 1e-12));
}

TEST(Blend, IsTheWeightedMeanOfTheMovedPoints) {
  const Eigen::Vector3d mean =
      0.25 * (kPose[0] * PointMm{kPoint}).lps + 0.75 * (kPose[1] * PointMm{kPoint}).lps;
  EXPECT_TRUE(Apply(Blend(Two(0.25f), kPose), kPoint).isApprox(mean, 1e-7));
}

TEST(Blend, ApplyInverseUndoesApply) {
  const AffineMap map = Blend(Two(0.4f), kPose);
  EXPECT_TRUE(ApplyInverse(map, Apply(map, kPoint)).isApprox(kPoint, 1e-10));
}

// Half way between 0 and 170 degrees the linear blend all but collapses; the guard must give a rotation of 85
// degrees.
TEST(Blend, NearSingularBlendsBecomeRotations) {
  const PointMm centre{{5, 6, 7}};
  const PoseVector bent = {{}, RotationAbout(centre, Eigen::Vector3d::UnitZ(), RadFromDeg(170))};
  const AffineMap map = Blend(Two(0.5f), bent);
  EXPECT_NEAR(map.leftCols<3>().determinant(), 1.0, 1e-9);
  const RigidTransform half = RotationAbout(centre, Eigen::Vector3d::UnitZ(), RadFromDeg(85));
  EXPECT_TRUE(Apply(map, kPoint).isApprox((half * PointMm{kPoint}).lps, 1e-6));
}

// On a circle of radius r about the axis of the turn, bones move points by r d(angle) at most, the linear
// blend and the dual-quaternion blend half way by half of that. From one to the other the radius grows from
// r cos(angle / 2) to r while the share, whose slope is 1.5 / 0.25 per determinant cos^2(angle / 2) at most,
// goes from 1 to 0: below 1.9 r d(angle) in all.
TEST(Blend, SmallStepsOfAGreatBendMovePointsBySmallSteps) {
  const PointMm centre{{5, 6, 7}};
  const Eigen::Vector3d at = centre.lps + Eigen::Vector3d(60, 0, 10);
  const double step_deg = 0.25;
  for (const float weight : {0.5f, 0.55f, 0.6f, 0.7f, 0.8f, 0.9f}) {
    Eigen::Vector3d before = Eigen::Vector3d::Constant(NAN);
    for (double deg = 100; deg <= 175; deg += step_deg) {
      const PoseVector bent = {{}, RotationAbout(centre, Eigen::Vector3d::UnitZ(), RadFromDeg(deg))};
      const Eigen::Vector3d now = Apply(Blend(Two(weight), bent), at);
      if (before.allFinite()) {
        ASSERT_LT((now - before).norm(), 1.9 * 60 * RadFromDeg(step_deg)) << weight << " at " << deg;
      }
      before = now;
    }
  }
}

// 107.3 degrees: cos^2 of half of them is 0.3514.
TEST(Blend, IsLinearUpToADeterminantOfAThird) {
  const PoseVector bent = {{}, RotationAbout({{5, 6, 7}}, Eigen::Vector3d::UnitZ(), RadFromDeg(107.3))};
  const Eigen::Vector3d mean = 0.5 * (kPoint + (bent[1] * PointMm{kPoint}).lps);
  EXPECT_TRUE(Apply(Blend(Two(0.5f), bent), kPoint).isApprox(mean, 1e-12));
}

// q and -q are the same rotation.
TEST(Blend, NearSingularBlendsDoNotDependOnTheQuaternionsSign) {
  const PoseVector bent = {{}, RotationAbout(PointMm{{5, 6, 7}}, Eigen::Vector3d::UnitZ(), RadFromDeg(170))};
  PoseVector negated = bent;
  negated[1].rotation.coeffs() *= -1;
  EXPECT_TRUE(Blend(Two(0.5f), negated).isApprox(Blend(Two(0.5f), bent), 1e-9));
}

}  // namespace
}  // namespace kvx
