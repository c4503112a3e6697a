// Rigid motions: group laws and the exponential map.
#include "core/rigid_transform.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/errors.h"

namespace kvx {
namespace {

TEST(RigidTransform, LogInvertsExp) {
  for (const double scale : {1e-9, 1e-3, 0.5, 2.0, 3.1}) {
    Twist twist;
    twist << scale * Eigen::Vector3d(1, -2, 2) / 3, 4.0, -5.0, 6.0;
    EXPECT_LT((Log(Exp(twist)) - twist).norm(), 1e-8) << "angle " << scale;
  }
}

TEST(RigidTransform, InverseCancels) {
  const RigidTransform b_from_a = Exp((Twist() << 0.3, 1.2, -0.7, 10, 20, -30).finished());
  EXPECT_TRUE((b_from_a * b_from_a.Inverse()).Matrix().isIdentity(1e-12));
}

TEST(RigidTransform, AQuarterTurnAboutACentre) {
  const RigidTransform turn = RotationAbout(PointMm{{1, 0, 0}}, {0, 0, 2}, kPi / 2);
  EXPECT_TRUE((turn * PointMm{{2, 0, 5}}).lps.isApprox(Eigen::Vector3d(1, 1, 5), 1e-12));
}

TEST(RigidTransform, RowMajorRoundTripAndRefusal) {
  const RigidTransform t = Exp((Twist() << 0.3, 1.2, -0.7, 10, 20, -30).finished());
  std::array<double, 16> m = RowMajor(t);
  EXPECT_DOUBLE_EQ(m[3], t.translation_mm.x());
  EXPECT_TRUE(RigidFromRowMajor(m).Matrix().isApprox(t.Matrix(), 1e-9));
  m[0] = 2.0;
  EXPECT_THROW(RigidFromRowMajor(m), InputError);
}

// q and -q are the same rotation; a turn by -10 degrees is not one by 350.
TEST(RigidTransform, LogTakesTheShorterWayWhateverTheQuaternionsSign) {
  for (const double degrees : {-170.0, -10.0, 0.0, 10.0, 90.0, 170.0}) {
    const RigidTransform turn = RotationAbout(PointMm{{3, -4, 5}}, {1, -2, 2}, RadFromDeg(degrees));
    RigidTransform negated = turn;
    negated.rotation.coeffs() *= -1;
    EXPECT_LT((Log(negated) - Log(turn)).norm(), 1e-9) << degrees;
    EXPECT_NEAR(Log(negated).head<3>().norm(), RadFromDeg(std::abs(degrees)), 1e-9);
  }
}

TEST(RigidTransform, SkewIsTheCrossProduct) {
  const Eigen::Vector3d w(0.3, -2, 5), x(1, 4, -0.7);
  EXPECT_LT((Skew(w) * x - w.cross(x)).norm(), 1e-12);
}

}  // namespace
}  // namespace kvx
