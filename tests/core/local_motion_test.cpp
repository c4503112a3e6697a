// Motions about a centre, by hand and there and back.
#include "core/local_motion.h"

#include <gtest/gtest.h>

#include "core/frames.h"

namespace kvx {
namespace {

TEST(LocalMotion, AHalfTurnAboutACentreLeavesItThere) {
  Twist by = Twist::Zero();
  by[2] = kPi;
  const PointMm centre{{10, 0, 0}};
  const RigidTransform moved = MovedLocally({}, by, centre);
  EXPECT_TRUE((moved * centre).lps.isApprox(centre.lps));
  EXPECT_TRUE((moved * PointMm{{12, 0, 5}}).lps.isApprox(Eigen::Vector3d(8, 0, 5)));
}

TEST(LocalMotion, IsWhatTookThePoseThere) {
  const RigidTransform pose = Exp((Twist() << 0.3, -0.2, 0.9, 40, -7, 12).finished());
  const Twist by = (Twist() << 0.02, -0.05, 0.01, 1, 2, -3).finished();
  const PointMm centre{{5, -60, 8}};
  const RigidTransform other = MovedLocally(pose, by, centre);
  EXPECT_TRUE(LocalMotion(pose, other, centre).isApprox(by, 1e-9));
}

}  // namespace
}  // namespace kvx
