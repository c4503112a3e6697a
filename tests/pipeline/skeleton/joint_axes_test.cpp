// Axes of motions that are known: turns about a bone's length that go with bending do not tilt them.
#include "pipeline/skeleton/joint_axes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/conjunct_bend.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using namespace testing_support;

const OrientedBox kBox{{}, Eigen::Matrix3d::Identity(), {40, 10, 10}};
const JointKnowledge kKnown{{}, true};

RelativeMotion Bent(double bend_deg, double aside_deg = 0) {
  RelativeMotion m;
  m.motion = ConjunctBend(bend_deg, aside_deg);
  return m;
}

double OffDeg(const std::vector<RelativeMotion>& motions, int dof_count, const JointKnowledge& known) {
  return BetweenAxesDeg(FitAxes(motions, kBox, dof_count, known).col(0), kConjunctHinge);
}

TEST(JointAxes, ConjunctRotationDoesNotTiltAHinge) {
  const std::vector<RelativeMotion> motions = {Bent(25), Bent(50), Bent(85)};
  EXPECT_GT(OffDeg(motions, 1, {}), 3);
  EXPECT_LT(OffDeg(motions, 1, kKnown), 1.5);
}

TEST(JointAxes, ConjunctRotationDoesNotTiltTheFirstOfTwoAxes) {
  const std::vector<RelativeMotion> motions = {Bent(20, 8), Bent(45, -8), Bent(70, 5), Bent(85, -6)};
  EXPECT_GT(OffDeg(motions, 2, {}), 3);
  EXPECT_LT(OffDeg(motions, 2, kKnown), 0.8 * OffDeg(motions, 2, {}));
}

// A joint of two axes that was scanned bending alone: its first axis is a hinge's, and nothing is known of
// the second.
TEST(JointAxes, ConjunctRotationDoesNotTiltTheFirstOfTwoAxesWhereTheSecondDoesNotShow) {
  const std::vector<RelativeMotion> motions = {Bent(25), Bent(50), Bent(85)};
  const Eigen::Matrix3d axes = FitAxes(motions, kBox, 2, kKnown);
  EXPECT_LT(OffDeg(motions, 2, kKnown), 1.5);
  EXPECT_TRUE(axes.isApprox(FitAxes(motions, kBox, 1, kKnown), 1e-9));
  const AxisCertainty certainty = CertaintyOf(motions, kBox, 2, kKnown, axes);
  EXPECT_EQ(certainty.fitted, 1) << "nothing is known of the second";
  // Turns about both, under five degrees about the second, may have gone together.
  EXPECT_NEAR(certainty.variance, std::pow(5.0 / 85, 2), 1e-4);
}

TEST(JointAxes, ConjunctRotationDoesNotTiltTheFirstOfThreeAxes) {
  const std::vector<RelativeMotion> motions = {Bent(25), Bent(50), Bent(85)};
  EXPECT_GT(OffDeg(motions, 3, {}), 3);
  EXPECT_LT(OffDeg(motions, 3, kKnown), 1.5);
  // The last axis is the bone's, so that its turns are those about its length.
  EXPECT_GT(std::abs(FitAxes(motions, kBox, 3, kKnown).col(2).dot(kConjunctLength)), std::cos(RadFromDeg(5)));
}

}  // namespace
}  // namespace kvx
