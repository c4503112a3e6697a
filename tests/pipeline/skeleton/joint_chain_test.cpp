// A finger of rods along x whose hinges all lie along z: what one joint leaves open, the others must tell.
#include "pipeline/skeleton/joint_chain.h"

#include <gtest/gtest.h>

#include "pipeline/skeleton/joint_axes.h"
#include "pipeline/skeleton/joint_centre.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

const Eigen::Vector3d kAlong = Eigen::Vector3d::UnitX(), kSpread = Eigen::Vector3d::UnitY(),
                      kHinge = Eigen::Vector3d::UnitZ();

// Hand, base (two degrees of freedom), middle and end, 20 mm long and 8 mm thick, 2 mm apart.
struct Finger {
  BoneSet bones;
  std::vector<JointPlan> plans = {{},
                                  {{"flexion", "abduction"}, "", true},
                                  {{"flexion"}, "", true, {{1, RadFromDeg(5), true}}},
                                  {{"flexion"}, "", true, {{2, RadFromDeg(5), true}}}};
  std::vector<std::vector<RelativeMotion>> motions;

  // With more than four bones, middles and ends go on as those before.
  explicit Finger(int count = 4) : motions(size_t(count)) {
    plans.resize(size_t(count), plans.back());
    for (int b = 2; b < count; ++b) plans[size_t(b)].parallel[0].bone = b - 1;
    Grid grid;
    grid.size = {22 * count, 12, 12};
    grid.origin.lps = {0, -5.5, -5.5};
    bones.labels = LabelMap(grid);
    for (int b = 0; b < count; ++b) {
      const double base_mm = 22.0 * b;
      for (int i = 0; i < 20; ++i) Fill(int(base_mm) + i, b + 1);
      bones.bones.push_back({.label = b + 1, .name = "bone", .parent = b - 1, .voxels = 1000});
      bones.bones.back().centroid.lps = {base_mm + 9.5, 0, 0};
      bones.bones.back().box = {PointMm{{base_mm, 0, 0}}, Eigen::Matrix3d::Identity(), {20, 8, 8}};
    }
  }
  void Fill(int i, int label) {
    for (int k = 2; k < 10; ++k) {
      for (int j = 2; j < 10; ++j) bones.labels(i, j, k) = uint16_t(label);
    }
  }
  void Add(int bone, const Eigen::Quaterniond& rotation, double twist_sd_deg) {
    RelativeMotion motion;
    motion.motion.rotation = rotation;
    motion.turn_spread = std::pow(RadFromDeg(0.3), 2) * Eigen::Matrix3d::Identity();
    motion.turn_spread(0, 0) = std::pow(RadFromDeg(twist_sd_deg), 2);
    motions[size_t(bone)].push_back(motion);
  }
  double OffDeg(int bone) const {
    return BetweenAxesDeg(FitAllAxes(bones, plans, motions)[size_t(bone)].axes.col(0), kHinge);
  }
};

Eigen::Quaterniond Turn(double deg, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(RadFromDeg(deg), axis));
}

Finger MovedFinger() {
  Finger finger;
  for (const double bend_deg : {20.0, 40.0, 60.0, 75.0}) {
    finger.Add(1, Turn(bend_deg, kHinge) * Turn(0.2 * bend_deg, kSpread), 2);  // bends and spreads together
    finger.Add(2, Turn(bend_deg, kHinge), 0.5);
    finger.Add(3, Turn(0.5 * bend_deg, kHinge) * Turn(5, kAlong), 4);  // all errors of the twist go one way
  }
  return finger;
}

TEST(FitAllAxes, HingesOfOneFingerHelpEachOther) {
  const Finger finger = MovedFinger();
  Finger apart = finger;
  for (JointPlan& plan : apart.plans) plan.parallel.clear();
  EXPECT_LT(finger.OffDeg(2), 0.5);
  EXPECT_LT(finger.OffDeg(1), 3) << "bending and spreading together hides the axis of the base";
  EXPECT_GT(apart.OffDeg(1), 1.5 * finger.OffDeg(1));
  EXPECT_LT(finger.OffDeg(3), 6) << "an uncertain twist tilts the axis of the end";
  EXPECT_GT(apart.OffDeg(3), 1.5 * finger.OffDeg(3));
}

// How parallel the hinges of a study are is learnt from the study: the more of them are seen to be, the more
// they say about the one that is not seen well.
TEST(FitAllAxes, ManyParallelHingesAreTrustedMore) {
  const auto off_of_last = [](int count) {
    Finger finger(count);
    for (const double bend_deg : {20.0, 40.0, 60.0, 75.0}) {
      for (int b = 1; b + 1 < count; ++b) finger.Add(b, Turn(bend_deg, kHinge), 0.5);
      finger.Add(count - 1, Turn(0.5 * bend_deg, kHinge) * Turn(5, kAlong), 4);
    }
    return finger.OffDeg(count - 1);
  };
  EXPECT_LT(off_of_last(12), 0.75 * off_of_last(4));
  EXPECT_GT(off_of_last(12), 0.1) << "never taken to be parallel altogether";
}

// One scan of a fist, in which the end's bone is doubtful: any two axes explain how the base turned, and the
// end's box says something else. The middle's hinge is what there is.
Finger FistWithADoubtfulEnd() {
  Finger finger;
  finger.Add(1, Turn(67, kHinge) * Turn(-7, kSpread), 0.5);
  finger.Add(2, Turn(76, kHinge), 0.5);
  finger.Add(3, Turn(38, kHinge), 4);
  finger.motions[3].back().weight = 0.01;
  return finger;
}

TEST(FitAllAxes, AJointThatIsNotShownDrawsNoOtherAway) {
  const Finger finger = FistWithADoubtfulEnd();
  for (const int joint : {1, 2, 3}) EXPECT_LT(finger.OffDeg(joint), 3) << joint;
}

// As well as its neighbour is, and as hinges of one finger are near parallel; of what nothing speaks, nothing
// is said.
TEST(FitAllAxes, AnAxisThatNeighboursAloneTellOfIsKnownAsTheyAre) {
  const auto variance = [](const Finger& finger, int joint) {
    return FitAllAxes(finger.bones, finger.plans, finger.motions)[size_t(joint)].variances[0];
  };
  Finger fist = FistWithADoubtfulEnd();
  fist.motions[3].clear();
  EXPECT_GT(variance(fist, 3), variance(fist, 2) + std::pow(RadFromDeg(2), 2));
  EXPECT_LT(variance(fist, 3), std::pow(RadFromDeg(9), 2));
  Finger still;
  for (const int joint : {1, 2, 3}) EXPECT_GT(variance(still, joint), std::pow(RadFromDeg(90), 2)) << joint;
  still.plans[2].parallel.clear();
  still.Add(1, Turn(4, kHinge), 0.5);
  EXPECT_TRUE(std::isinf(variance(still, 1)))
      << "from the box: four degrees are within what bones are found to";
}

// A saddle joint lies on a bent finger's hinge, roughly parallel to it. Turned by little about both its axes
// it shows their plane, but hardly which of all pairs in it they are.
TEST(FitAllAxes, ASaddleJointTurnsAboutTheHingeBeyondIt) {
  Finger finger;
  finger.plans[2].parallel[0] = {1, RadFromDeg(20)};
  finger.Add(1, Turn(12, kHinge) * Turn(8, kSpread), 0.5);
  for (const int joint : {2, 3}) finger.Add(joint, Turn(40, kHinge), 0.5);
  Finger apart = finger;
  apart.plans[2].parallel.clear();
  EXPECT_LT(finger.OffDeg(1), 5);
  EXPECT_GT(apart.OffDeg(1), 20) << "the dominant axis";
  const auto fitted = FitAllAxes(finger.bones, finger.plans, finger.motions);
  for (const int d : {0, 1}) {
    EXPECT_GT(fitted[1].variances[d], std::pow(RadFromDeg(10), 2))
        << "half of the spread, about the bone alone";
    EXPECT_LT(fitted[1].variances[d], std::pow(RadFromDeg(20), 2));
  }
}

// A spread that is not learnt is not taken for that of the finger's hinges either.
TEST(FitAllAxes, HowParallelHingesAreIsLearntFromHingesAlone) {
  const auto variance_of_end = [](std::vector<ParallelJoint> middle) {
    Finger finger = MovedFinger();
    for (RelativeMotion& motion : finger.motions[1])
      motion.motion.rotation = Turn(25, kAlong) * motion.motion.rotation * Turn(-25, kAlong);
    finger.motions[3].clear();
    finger.plans[2].parallel = std::move(middle);
    return FitAllAxes(finger.bones, finger.plans, finger.motions)[3].variances[0];
  };
  const double alone = variance_of_end({});
  EXPECT_NEAR(variance_of_end({{1, RadFromDeg(20)}}), alone, 0.05 * alone);
  EXPECT_GT(variance_of_end({{1, RadFromDeg(5), true}}), 1.5 * alone);
}

TEST(FitAllAxes, AJointThatNeverMovedTakesItsNeighboursAxis) {
  Finger finger = MovedFinger();
  finger.motions[3].clear();
  EXPECT_LT(finger.OffDeg(3), 0.5);
}

// Three axes explain every turn, so how well the first of them is known is not said.
TEST(FitAllAxes, AJointOfThreeAxesLeavesItsNeighboursAsTheyAre) {
  Finger finger = MovedFinger();
  finger.plans[1].dofs = {"flexion", "abduction", "rotation"};
  EXPECT_LT(finger.OffDeg(2), 0.5);
  EXPECT_LT(finger.OffDeg(3), 6);
  const auto fitted = FitAllAxes(finger.bones, finger.plans, finger.motions);
  EXPECT_TRUE(std::isinf(fitted[1].variances[0]));
  EXPECT_LT(fitted[2].variances[0], std::pow(RadFromDeg(3), 2));
}

// Nor do they follow it where it turns about an axis far from theirs, whether or not scans show theirs.
TEST(FitAllAxes, AJointOfThreeAxesTiltsNoNeighbour) {
  for (const double bend_deg : {0.0, 8.0, 20.0}) {
    Finger finger;
    finger.plans[1].dofs = {"flexion", "abduction", "rotation"};
    finger.Add(1, Turn(25, (kSpread + kHinge).normalized()), 0.5);
    for (const int joint : {2, 3}) finger.Add(joint, Turn(bend_deg, kHinge), 0.5);
    Finger apart = finger;
    apart.plans[2].parallel.clear();
    const auto fitted = FitAllAxes(finger.bones, finger.plans, finger.motions),
               alone = FitAllAxes(apart.bones, apart.plans, apart.motions);
    for (const size_t joint : {2, 3}) {
      EXPECT_EQ(fitted[joint].axes, alone[joint].axes) << bend_deg;
      EXPECT_EQ(fitted[joint].variances, alone[joint].variances) << bend_deg;
    }
  }
}

// Either of a joint's two axes may be the hinges', so a turn about one alone says of neither where it lies.
TEST(FitAllAxes, AFingerThatIsSpreadAloneDoesNotSayHowItBends) {
  Finger finger;
  finger.Add(1, Turn(20, kSpread), 0.5);
  for (const int joint : {2, 3}) finger.Add(joint, Turn(1, kSpread), 0.5);
  for (const FittedAxes& fitted : FitAllAxes(finger.bones, finger.plans, finger.motions))
    EXPECT_TRUE(fitted.variances.array().isInf().all());
  finger.Add(3, Turn(30, kHinge), 0.5);
  const auto fitted = FitAllAxes(finger.bones, finger.plans, finger.motions);
  for (const size_t joint : {1, 2, 3}) {
    EXPECT_LT(BetweenAxesDeg(fitted[joint].axes.col(0), kHinge), 3) << joint;
    EXPECT_LT(fitted[joint].variances[0], std::pow(RadFromDeg(10), 2)) << joint;
  }
}

// Four fingers side by side, base and middle of each, which are spread and do not bend. The row of their
// bases leans by 10 degrees from their hinges.
TEST(FitAllAxes, AFingerThatIsSpreadAloneBendsAboutTheRowOfItsKnuckles) {
  BoneSet bones;
  bones.bones.push_back({.label = 1, .name = "hand"});
  std::vector<JointPlan> plans(1);
  std::vector<std::vector<RelativeMotion>> motions(1);
  for (int f = 0; f < 4; ++f) {
    Finger finger;
    finger.Add(1, Turn(12 * f - 16, kSpread), 0.5);
    finger.Add(2, Turn(0, kSpread), 0.5);
    if (f > 0) finger.plans[1].parallel = {{2 * f - 1, RadFromDeg(15), false, RadFromDeg(20)}};
    finger.plans[2].parallel[0].bone = 2 * f + 1;
    for (const size_t b : {1, 2}) {
      bones.bones.push_back(finger.bones.bones[b]);
      bones.bones.back().parent = b == 1 ? 0 : 2 * f + 1;
      bones.bones.back().box.origin.lps += 20.0 * f * (kHinge + std::tan(RadFromDeg(10)) * kSpread);
      plans.push_back(finger.plans[b]), motions.push_back(finger.motions[b]);
    }
  }
  const auto fitted = FitAllAxes(bones, plans, motions);
  for (size_t b = 1; b < fitted.size(); ++b) {
    const double off_deg = BetweenAxesDeg(fitted[b].axes.col(0), kHinge);
    EXPECT_LT(off_deg, 12) << b;
    EXPECT_LT(off_deg, DegFromRad(2.45 * std::sqrt(fitted[b].variances[0]))) << b;
    EXPECT_LT(fitted[b].variances[0], std::pow(RadFromDeg(20), 2)) << b;
  }
}

TEST(FitAllAxes, WhatIsSeenClearlyOutweighsTheNeighbours) {
  Finger finger = MovedFinger();
  const Eigen::Vector3d skew = (kHinge + std::tan(RadFromDeg(12)) * kSpread).normalized();
  finger.motions[3].clear();
  for (const double bend_deg : {20.0, 40.0, 60.0, 75.0}) finger.Add(3, Turn(bend_deg, skew), 0.3);
  EXPECT_NEAR(finger.OffDeg(3), 12, 1.5);
}

// The head is half as thick as the bone.
TEST(UsualCentre, LiesInTheHeadThatABoneTurnsAbout) {
  const Finger finger;
  const PointMm gap = UsualCentre(finger.bones, 2, false).place,
                head = UsualCentre(finger.bones, 2, true).place;
  EXPECT_LT((gap.lps - Eigen::Vector3d(42.5, 0, 0)).norm(), 0.2) << "voxels near the rim pull a little";
  EXPECT_LT((head.lps - (gap.lps - 4 * kAlong)).norm(), 1e-6);
  EXPECT_LT((FitCentre({}, UsualCentre(finger.bones, 2, true)).lps - head.lps).norm(), 1e-12);
}

// What turns by some degrees only says little of where it turns; what turns far says it all.
TEST(FitCentre, FarTurnsOutweighWhatIsUsual) {
  const CentreBelief usual{PointMm{{2, 0, 0}}, 0.04};
  const auto found = [&](double deg) {
    RelativeMotion motion;
    motion.motion.rotation = Turn(deg, kHinge);  // about the origin
    return FitCentre(std::vector{motion}, usual).lps.x();
  };
  // sum of squares 2 (1 - cos) c^2 + 0.04 (c - 2)^2 is least at:
  for (const double deg : {5.0, 80.0}) {
    const double seen = 2 * (1 - std::cos(RadFromDeg(deg)));
    EXPECT_NEAR(found(deg), 0.08 / (seen + 0.04), 1e-9);
  }
}

// Scans that all count a tenth show the same centre as scans that all count fully.
TEST(FitCentre, WeighsScansAgainstEachOtherAlone) {
  const CentreBelief usual{PointMm{{2, 0, 0}}, 0.04};
  std::vector<RelativeMotion> motions(2);
  motions[0].motion = RotationAbout(PointMm{}, kHinge, RadFromDeg(10));
  motions[1].motion = RotationAbout(PointMm{{0, 1, 0}}, kHinge, RadFromDeg(30));
  const PointMm once = FitCentre(motions, usual);
  for (RelativeMotion& motion : motions) motion.weight = 0.1;
  EXPECT_LT((FitCentre(motions, usual).lps - once.lps).norm(), 1e-9);
}

// An axis and its opposite are the same axis: neighbours that are given in opposite directions do not cancel.
TEST(FitAxes, NeighboursInOppositeDirectionsAgree) {
  const Finger finger;
  const Eigen::Vector3d tilted = (kHinge + std::tan(RadFromDeg(4)) * kSpread).normalized();
  const JointKnowledge known{{{kHinge, RadFromDeg(5)}, {-tilted, RadFromDeg(5)}}, false};
  const Eigen::Vector3d axis = FitAxes({}, finger.bones.bones[2].box, 1, known).col(0);
  EXPECT_NEAR(BetweenAxesDeg(axis, kHinge), 2, 0.1) << "half way";
  EXPECT_NEAR(BetweenAxesDeg(axis, tilted), 2, 0.1);
}

}  // namespace
}  // namespace kvx
