// Forward kinematics on a chain whose poses can be written down.
#include "core/skeleton.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

// Three bones along x; elbows at x = 10 and x = 20 that bend about z, the first also about y.
Skeleton Chain() {
  Skeleton s;
  s.joints.resize(3);
  s.joints[1] = {.child = 1, .parent = 0, .centre = {{10, 0, 0}}};
  s.joints[1].dofs = {{"flexion", Eigen::Vector3d::UnitZ()}, {"abduction", Eigen::Vector3d::UnitY()}};
  s.joints[2] = {.child = 2, .parent = 1, .centre = {{20, 0, 0}}};
  s.joints[2].dofs = {{"flexion", Eigen::Vector3d::UnitZ()}};
  return s;
}

TEST(ForwardKinematics, RightAnglesAlongAChain) {
  const JointAngles angles = (JointAngles(3) << kPi / 2, 0, kPi / 2).finished();
  const PoseVector pose = ForwardKinematics(Chain(), angles, {}, {});
  EXPECT_TRUE((pose[1] * PointMm{{20, 0, 0}}).lps.isApprox(Eigen::Vector3d(10, 10, 0), 1e-12));
  EXPECT_TRUE((pose[2] * PointMm{{30, 0, 0}}).lps.isApprox(Eigen::Vector3d(0, 10, 0), 1e-12));
}

TEST(ForwardKinematics, TheFirstAxisIsOutermost) {
  const JointAngles angles = (JointAngles(3) << kPi / 2, kPi / 2, 0).finished();
  const PoseVector pose = ForwardKinematics(Chain(), angles, {}, {});
  // About y first: x goes to -z, which a turn about z leaves alone.
  EXPECT_TRUE((pose[1] * PointMm{{11, 0, 0}}).lps.isApprox(Eigen::Vector3d(10, 0, -1), 1e-12));
}

// A millimetre counts as a degree, both times pi/180; the centre shifts by it, whatever the joint turns.
TEST(JointMotion, TheLastThreeOfSixDegreesShiftTheCentre) {
  Joint joint{.child = 1, .parent = 0, .centre = PointMm{{5, -2, 7}}};
  for (int d = 0; d < 6; ++d) joint.dofs.push_back({"d", Eigen::Vector3d::Unit(d % 3)});
  const double values[] = {RadFromDeg(20), RadFromDeg(-30), RadFromDeg(70),
                           RadFromDeg(1),  RadFromDeg(-2),  RadFromDeg(3)};
  const RigidTransform motion = JointMotion(joint, values);
  EXPECT_LT(((motion * joint.centre).lps - joint.centre.lps - Eigen::Vector3d(1, -2, 3)).norm(), 1e-12);
  joint.dofs.resize(3);
  EXPECT_LT(motion.rotation.angularDistance(JointMotion(joint, values).rotation), 1e-12);
}

TEST(ForwardKinematics, RootAndResidualsAct) {
  const RigidTransform root{Eigen::Quaterniond::Identity(), {1, 2, 3}};
  std::vector<Twist> residuals(3, Twist::Zero());
  residuals[1].tail<3>() = Eigen::Vector3d(0, 0, 5);
  const PoseVector pose = ForwardKinematics(Chain(), JointAngles::Zero(3), root, residuals);
  EXPECT_TRUE(pose[0].translation_mm.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(pose[2].translation_mm.isApprox(Eigen::Vector3d(1, 2, 8)));
}

TEST(Skeleton, NamesItsDegreesOfFreedom) {
  const std::vector<std::string> names = {"a", "b", "c"};
  EXPECT_EQ(Chain().DofCount(), 3);
  EXPECT_EQ(Chain().FirstDof(2), 2);
  EXPECT_EQ(Chain().DofIndex("c.flexion", names), 2);
  EXPECT_THAT([&] { Chain().DofIndex("a.flexion", names); },
              testing::ThrowsMessage<NotFound>(testing::EndsWith("b.flexion, b.abduction, c.flexion")));
}

// A list of nothing is no advice.
TEST(Skeleton, WithoutDegreesOfFreedomSaysHowElseToPose) {
  const Skeleton one{.joints = {Joint{}}};
  EXPECT_THAT(
      [&] { one.DofIndex("a.flexion", {"a"}); },
      testing::ThrowsMessage<NotFound>(testing::HasSubstr("pose it by a scan or by bone transforms")));
}

}  // namespace
}  // namespace kvx
