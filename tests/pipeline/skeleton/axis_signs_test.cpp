// A finger whose hinges all lie along z, in worlds turned as one likes: axes point the same way within the
// finger, whatever signs the solver of eigenvalues and the box happen to have.
#include "pipeline/skeleton/axis_signs.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kvx {
namespace {

const Eigen::Vector3d kAlong = Eigen::Vector3d::UnitX(), kSpread = Eigen::Vector3d::UnitY(),
                      kHinge = Eigen::Vector3d::UnitZ();

Eigen::Quaterniond Turn(double deg, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(RadFromDeg(deg), axis));
}

// Of a bone along x, wide along y, in a turned world, its second axis to either side as the world has it.
OrientedBox BoxIn(const Eigen::Quaterniond& world) {
  OrientedBox box;
  box.axes.col(0) = world * kAlong;
  box.axes.col(1) = world * kSpread;
  Eigen::Index largest;
  box.axes.col(1).cwiseAbs().maxCoeff(&largest);
  if (box.axes(largest, 1) < 0) box.axes.col(1) *= -1;
  box.axes.col(2) = box.axes.col(0).cross(box.axes.col(1));
  box.extent_mm = {20, 9, 8};
  return box;
}

// Hand, base (bends and spreads), middle and end.
struct Finger {
  std::vector<JointPlan> plans = {{},
                                  {{"flexion", "abduction"}, "", true},
                                  {{"flexion"}, "", true, {{1, RadFromDeg(5), true}}},
                                  {{"flexion"}, "", true, {{2, RadFromDeg(5), true}}}};
  std::vector<std::vector<Eigen::Quaterniond>> turns{4};

  // Axes of one bone, in the finger's own frame.
  Eigen::Matrix3d AxesOf(size_t bone,
                         const Eigen::Quaterniond& world = Eigen::Quaterniond::Identity()) const {
    BoneSet bones;
    std::vector<std::vector<RelativeMotion>> motions(turns.size());
    for (size_t b = 0; b < turns.size(); ++b) {
      bones.bones.push_back({.label = int(b) + 1, .name = "bone", .parent = int(b) - 1, .box = BoxIn(world)});
      for (const Eigen::Quaterniond& turn : turns[b])
        motions[b].push_back({{world * turn * world.conjugate(), {0, 0, 0}}});
    }
    std::vector<FittedAxes> joints = FitAllAxes(bones, plans, motions);
    OrientAxes(bones, plans, motions, joints);
    return world.conjugate() * joints[bone].axes;
  }
};

// Spreads by a degree and its end does not bend: neither shows which way.
Finger BentFinger(double sign) {
  Finger finger;
  for (const double bend_deg : {20.0, 40.0, 75.0}) {
    const double spread_deg = bend_deg == 40 ? 1 : -0.7;
    finger.turns[1].push_back(Turn(sign * bend_deg, kHinge) * Turn(spread_deg, kSpread));
    finger.turns[2].push_back(Turn(sign * bend_deg, kHinge));
    finger.turns[3].push_back(Turn(-sign, kHinge));
  }
  return finger;
}

class AFingerIn : public testing::TestWithParam<Eigen::Quaterniond> {};

TEST_P(AFingerIn, PointsTheSameWay) {
  for (const double sign : {1.0, -1.0}) {
    Finger finger = BentFinger(sign);
    for (int order = 0; order < 2; ++order) {
      const Eigen::Matrix3d base = finger.AxesOf(1, GetParam());
      EXPECT_GT(base.col(0).dot(sign * kHinge), 0.99);
      EXPECT_GT(base.col(1).dot(kAlong.cross(sign * kHinge)), 0.99) << "across the bone and the first axis";
      EXPECT_GT(finger.AxesOf(2, GetParam()).col(0).dot(sign * kHinge), 0.99);
      EXPECT_GT(finger.AxesOf(3, GetParam()).col(0).dot(sign * kHinge), 0.99) << "the end's, as the middle's";
      for (auto& turns : finger.turns) std::ranges::reverse(turns);  // scans in another order
    }
  }
}

// The saddle joint at the base of a thumb has no parallel neighbour.
TEST_P(AFingerIn, PointsTheSameWayWithoutNeighbours) {
  Finger finger = BentFinger(1);
  for (JointPlan& plan : finger.plans) plan.parallel.clear();
  const Eigen::Matrix3d base = finger.AxesOf(1, GetParam());
  EXPECT_GT(base.col(0).dot(kHinge), 0.99);
  EXPECT_GT(base.col(1).dot(kAlong.cross(kHinge)), 0.99);
}

// A straight leg with its kneecap in front: a tibia bends backwards, however its box is turned about its
// length.
TEST_P(AFingerIn, AKneeOfOneScanBendsAwayFromThePatella) {
  const Eigen::Quaterniond world = GetParam();
  for (const double way : {1.0, -1.0}) {
    BoneSet bones;
    bones.bones = {{.label = 1, .name = "femur"},
                   {.label = 2, .name = "tibia", .parent = 0, .box = BoxIn(world)},
                   {.label = 3, .name = "patella", .parent = 0, .box = BoxIn(world)}};
    bones.bones[2].centroid.lps = world * (-20 * kAlong + 40 * kSpread);
    const std::vector<JointPlan> plans = {{}, {{"flexion"}}, {{}, "tibia"}};
    const std::vector<std::vector<RelativeMotion>> motions(3);
    std::vector<FittedAxes> joints = FitAllAxes(bones, plans, motions);
    joints[1].axes.col(0) = way * (world * kHinge);
    OrientAxes(bones, plans, motions, joints);
    const Eigen::Vector3d far_end = world * (20 * kAlong);
    const Eigen::Vector3d bent = Eigen::AngleAxisd(RadFromDeg(30), joints[1].axes.col(0)) * far_end;
    EXPECT_NEAR(bent.dot(world * kSpread), -20 * std::sin(RadFromDeg(30)), 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(TurnedWorlds, AFingerIn,
                         testing::Values(Eigen::Quaterniond::Identity(), Turn(180, kHinge),
                                         Turn(180, kSpread), Turn(180, kAlong), Turn(100, {0.6, 0, 0.8})));

TEST(OrientAxes, AStillBaseTakesTheDirectionOfTheJointBeyondIt) {
  for (const double sign : {1.0, -1.0}) {
    Finger finger = BentFinger(sign);
    finger.turns[1].clear();
    EXPECT_GT(finger.AxesOf(1).col(0).dot(sign * kHinge), 0.99);
    EXPECT_GT(finger.AxesOf(3).col(0).dot(sign * kHinge), 0.99);
  }
}

// A template with bent fingers: the scans straighten the base more than they bend it, the middle less. One
// sign of the angles straightens both.
TEST(OrientAxes, AFingerBendsAsAWhole) {
  for (const double sign : {1.0, -1.0}) {
    Finger finger;
    for (const double bend_deg : {-40.0, 30.0, 5.0}) {
      finger.turns[1].push_back(Turn(sign * bend_deg, kHinge));
      finger.turns[2].push_back(Turn(sign * (bend_deg + 20), kHinge));
      finger.turns[3].push_back(Turn(sign * bend_deg, kHinge));
    }
    for (const size_t joint : {1, 2, 3})
      EXPECT_GT(finger.AxesOf(joint).col(0).dot(sign * kHinge), 0.99) << "-5, 55 and -5 degrees in sum";
  }
}

TEST(OrientAxes, WhatTheScansShowOfASecondAxisSaysWhichWay) {
  for (const double sign : {1.0, -1.0}) {
    Finger finger = BentFinger(1);
    finger.turns[1] = {Turn(40, kHinge) * Turn(sign * 12, kSpread), Turn(20, kHinge), Turn(70, kHinge)};
    EXPECT_GT(finger.AxesOf(1).col(1).dot(sign * kSpread), 0.95);
  }
}

// 10 degrees of a bone that is sure against 40 of one in doubt, which counts a hundredth.
TEST(OrientAxes, WhatIsInDoubtHardlySaysWhichWay) {
  BoneSet bones;
  for (int b = 0; b < 2; ++b)
    bones.bones.push_back(
        {.label = b + 1, .name = "bone", .parent = b - 1, .box = BoxIn(Eigen::Quaterniond::Identity())});
  const std::vector<JointPlan> plans = {{}, {{"flexion"}}};
  for (const double sign : {1.0, -1.0}) {
    std::vector<std::vector<RelativeMotion>> motions(2);
    motions[1] = {{{Turn(sign * 10, kHinge), {0, 0, 0}}, 1}, {{Turn(-sign * 40, kHinge), {0, 0, 0}}, 0.01}};
    std::vector<FittedAxes> joints = FitAllAxes(bones, plans, motions);
    OrientAxes(bones, plans, motions, joints);
    EXPECT_GT(joints[1].axes.col(0).dot(sign * kHinge), 0.99);
  }
}

TEST(OrientAxes, OfWhatNeverMovesTheBoxDecides) {
  Finger finger;
  finger.plans[1].dofs = {"flexion", "abduction", "rotation"};
  const Eigen::Matrix3d axes = finger.AxesOf(1);
  EXPECT_LT((axes.col(0) - kSpread).norm(), 1e-9);
  EXPECT_LT((axes.col(1) - kHinge).norm(), 1e-9);
  EXPECT_LT((axes.col(2) - kAlong).norm(), 1e-9);
}

// A joint of three that turns about two of them: the third is their product, as those point.
TEST(OrientAxes, AThirdAxisKeepsTheFrameRightHanded) {
  for (const double sign : {1.0, -1.0}) {
    Finger finger;
    finger.plans = {{}, {{"bend", "tilt", "twist"}}, {}, {}};
    for (const double bend_deg : {30.0, 70.0}) {
      for (const double tilt_deg : {8.0, -8.0})
        finger.turns[1].push_back(Turn(sign * bend_deg, kHinge) * Turn(tilt_deg, kSpread));
    }
    finger.turns[1].push_back(Turn(8, kSpread));
    EXPECT_GT(finger.AxesOf(1).col(0).dot(sign * kHinge), 0.99);
    EXPECT_GT(finger.AxesOf(1).col(1).dot(kSpread), 0.8);
    EXPECT_GT(finger.AxesOf(1).determinant(), 0.99);
  }
}

}  // namespace
}  // namespace kvx
