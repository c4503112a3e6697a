// Bones that look nearly the same when turned by half: right, or flagged.
#include "pipeline/bones/twin_poses.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

const Grid kView = Box({60, 60, 60}, {1.2, 1.2, 1.2}, kOblique.transpose());

RigidTransform TurnedBy(double deg, const Eigen::Vector3d& axis) {
  return Exp((Twist() << RadFromDeg(deg) * axis.normalized(), 2, -1, 1.5).finished());
}

// A texture that differs from its half turns is enough to decide, or else the bone is named.
TEST(TwinPoses, ATexturedEllipsoidTurnedFarIsRightOrFlagged) {
  const EllipsoidWorld world(kOneBone, Box({56, 44, 34}, {1.0, 1.2, 1.5}, kOblique));
  size_t right = 0, turns = 0;
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), {0, 1, 0}, {1, 2, -1}}) {
    for (const double deg : {140.0, 175.0}) {
      const RigidTransform truth = TurnedBy(deg, axis);
      const BoneFit fit = world.Register(Painted(kView, kOneBone, {truth})).at(0);
      const double off_deg = AngleDeg(fit.scan_from_template, truth);
      EXPECT_TRUE(off_deg < 1.5 || fit.doubtful) << deg << " about " << axis.transpose() << ": " << off_deg;
      right += off_deg < 1.5, ++turns;
    }
  }
  EXPECT_GE(right, turns / 2);
}

}  // namespace
}  // namespace kvx
