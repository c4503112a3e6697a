// One joint from motions that are given: its axes, the gap that it lies in, how surely a motion is known.
#include "pipeline/skeleton/joint_axes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/joint_values.h"
#include "pipeline/skeleton/fit_skeleton.h"
#include "pipeline/skeleton/joint_centre.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Fingers: a round bone's turn about its long axis is known to some degrees, its bend to tenths of one. Here
// all errors of the turn go one way.
TEST(FitAxes, AnUncertainTurnDoesNotTiltTheAxis) {
  const Eigen::Vector3d along = Eigen::Vector3d::UnitX(), hinge = Eigen::Vector3d::UnitZ();
  OrientedBox box;  // long axis x
  box.extent_mm = {20, 8, 8};
  std::vector<RelativeMotion> motions;
  for (const double bend_deg : {10.0, 20.0, 30.0, 40.0}) {
    RelativeMotion m;
    m.motion.rotation =
        Eigen::AngleAxisd(RadFromDeg(bend_deg), hinge) * Eigen::AngleAxisd(RadFromDeg(6), along);
    motions.push_back(m);
  }
  const auto off_deg = [&] { return BetweenAxesDeg(FitAxes(motions, box, 1).col(0), hinge); };
  for (RelativeMotion& m : motions) {
    m.turn_spread = (RadFromDeg(0.3) * RadFromDeg(0.3) * Eigen::Vector3d::Ones()).asDiagonal();
    m.turn_spread(0, 0) = RadFromDeg(6) * RadFromDeg(6);
  }
  const double knowing = off_deg();
  EXPECT_LT(knowing, 8);
  for (RelativeMotion& m : motions) m.turn_spread.setZero();
  EXPECT_LT(knowing, 0.6 * off_deg());
}

std::vector<RelativeMotion> TurnsAbout(const Eigen::Vector3d& axis, std::initializer_list<double> degrees) {
  std::vector<RelativeMotion> motions(degrees.size());
  std::ranges::transform(degrees, motions.begin(), [&](double deg) {
    return RelativeMotion{{Eigen::Quaterniond(Eigen::AngleAxisd(RadFromDeg(deg), axis)), {0, 0, 0}}};
  });
  return motions;
}

// What is seen clearly outweighs what is usual: an axis far from a right angle to the bone.
TEST(FitAxes, AnObliqueAxisIsFoundWhereScansShowIt) {
  const Eigen::Vector3d oblique = Eigen::Vector3d(1, 0, 1).normalized();
  OrientedBox box;
  box.extent_mm = {20, 8, 8};
  const std::vector<RelativeMotion> motions = TurnsAbout(oblique, {15, 30, 50});
  EXPECT_LT(BetweenAxesDeg(FitAxes(motions, box, 1).col(0), oblique), 2);
}

// However the axis lies in space, rounding does not make a second one of it.
TEST(FitAxes, OneTurnOfAJointOfTwoAxesIsAHinges) {
  OrientedBox box;
  box.extent_mm = {50, 15, 14};
  for (int n = 0; n < 100; ++n) {
    const Eigen::Vector3d axis = Eigen::Vector3d(std::cos(n), std::sin(2 * n), std::cos(5 * n)).normalized();
    for (const auto degrees : {std::initializer_list<double>{40}, {25, 25, -25}}) {
      const std::vector<RelativeMotion> motions = TurnsAbout(axis, degrees);
      const Eigen::Matrix3d axes = FitAxes(motions, box, 2);
      EXPECT_LT(BetweenAxesDeg(axes.col(0), FitAxes(motions, box, 1).col(0)), 1e-3) << n;
      EXPECT_EQ(CertaintyOf(motions, box, 2, {}, axes).fitted, 1) << n;
    }
  }
}

// Where nothing shows that a joint has a conjunct rotation, an oblique hinge is hardly taken for one.
TEST(FitAxes, AnObliqueHingeStaysAboutAsItIsWithConjunctRotation) {
  const Eigen::Vector3d oblique = Eigen::Vector3d(std::sin(RadFromDeg(8)), 0, std::cos(RadFromDeg(8)));
  OrientedBox box;
  box.extent_mm = {40, 10, 10};
  const std::vector<RelativeMotion> motions = TurnsAbout(oblique, {25, 50, 85});
  EXPECT_LT(BetweenAxesDeg(FitAxes(motions, box, 1, {{}, true}).col(0), oblique), 2);
}

// Of a joint by itself; turns about a lone axis change nothing.
Eigen::Vector3d VariancesOf(const AxisCertainty& certainty, const Eigen::Matrix3d& axes) {
  const Eigen::Matrix3d known = certainty.information + 1e-6 * Eigen::Matrix3d::Identity();
  return AxisVariances(certainty, known.inverse(), axes);
}

// A hinge tilted by a small angle misses a turn of t by 2 sin(t / 2) of that, across the axis; a joint's own
// play is taken to be a degree.
TEST(AxisVariances, OfAHingeAreThoseOfItsTurnsAndItsPlay) {
  const double spread_deg = 0.5, play_deg = 1;
  OrientedBox round;  // so that no length says where the axis lies
  round.extent_mm = {10, 10, 10};
  std::vector<RelativeMotion> motions;
  double squares = 0;
  for (const double bend_deg : {20.0, 45.0, 70.0}) {
    RelativeMotion m;
    m.motion.rotation = Eigen::AngleAxisd(RadFromDeg(bend_deg), Eigen::Vector3d::UnitZ());
    m.turn_spread = std::pow(RadFromDeg(spread_deg), 2) * Eigen::Matrix3d::Identity();
    motions.push_back(m);
    squares += std::pow(2 * std::sin(RadFromDeg(bend_deg) / 2), 2);
  }
  const double expected = (std::pow(RadFromDeg(spread_deg), 2) + std::pow(RadFromDeg(play_deg), 2)) / squares;
  const Eigen::Matrix3d axes = FitAxes(motions, round, 1);
  ASSERT_LT(BetweenAxesDeg(axes.col(0), Eigen::Vector3d::UnitZ()), 1e-3);
  const Eigen::Vector3d variances = VariancesOf(CertaintyOf(motions, round, 1, {}, axes), axes);
  EXPECT_NEAR(variances[0], expected, 0.01 * expected);
  EXPECT_TRUE(std::isinf(variances[1])) << "not a degree of freedom";
  EXPECT_TRUE(VariancesOf(CertaintyOf(motions, round, 3, {}, axes), axes).array().isInf().all())
      << "explain every turn";
}

TEST(FitSkeleton, OfAnAxisThatMayLieAnywhereNoBoundIsStated) {
  SkeletonFit fit;
  EXPECT_TRUE(std::isinf(fit.AxisWithinRad(1, 0))) << "of an earlier version";
  fit.axis_within_rad = {{}, {RadFromDeg(89), RadFromDeg(90), RadFromDeg(300)}};
  EXPECT_NEAR(DegFromRad(fit.AxisWithinRad(1, 0)), 89, 1e-9);
  EXPECT_TRUE(std::isinf(fit.AxisWithinRad(1, 1)));
  EXPECT_TRUE(std::isinf(fit.AxisWithinRad(1, 2)));
}

// Two large bones, unlike on all sides; the same world, its voxels stored backwards.
TEST(FindGap, DoesNotAskInWhichOrderVoxelsAreStored) {
  Grid grid;
  grid.size = {130, 66, 64};
  LabelMap labels(grid);
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const Eigen::Vector3d x = grid.Ijk(v).cast<double>();
    const double first = (x - Eigen::Vector3d(32, 34, 31)).cwiseQuotient(Eigen::Vector3d(30, 28, 26)).norm();
    const double second = (x - Eigen::Vector3d(95, 31, 33)).cwiseQuotient(Eigen::Vector3d(31, 27, 29)).norm();
    labels.values[v] = first <= 1 ? 1 : second <= 1 ? 2 : 0;
  }
  LabelMap backwards = labels;
  backwards.grid.direction = -grid.direction;
  backwards.grid.origin = grid.ToMm(PointVox{(grid.size.array() - 1).cast<double>()});
  std::ranges::reverse(backwards.values);
  const auto gap = FindGap(labels, 1, 2), same = FindGap(backwards, 1, 2);
  ASSERT_TRUE(gap && same);
  EXPECT_LT((gap->lps - same->lps).norm(), 1e-6);
}

// Of a small turn of the parent or the child about each axis by itself, whose squares make up the
// covariances.
TEST(MotionOf, SpreadsAsTheTurnsOfBothBonesDo) {
  const Eigen::Vector3d parent_sd(0.1e-4, 3e-4, 1e-4), child_sd(2e-4, 0.5e-4, 0.2e-4);
  BoneFit parent, child;
  parent.scan_from_template = Exp((Twist() << 0.2, -0.1, 0.3, 5, 6, -7).finished());
  child.scan_from_template =
      parent.scan_from_template * RotationAbout(PointMm{{4, 5, 6}}, {1, 2, 3}, RadFromDeg(70));
  parent.covariance.diagonal().head<3>() = parent_sd.cwiseAbs2();
  child.covariance.diagonal().head<3>() = child_sd.cwiseAbs2();
  const RelativeMotion motion = MotionOf(parent, child, 1);
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (int a = 0; a < 6; ++a) {
    BoneFit turned[2] = {parent, child};
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(a % 3);
    const double by_rad = (a < 3 ? parent_sd : child_sd)[a % 3];
    RigidTransform& pose = turned[a / 3].scan_from_template;
    pose = pose * RotationAbout(PointMm{}, axis, by_rad);
    const RigidTransform other = MotionOf(turned[0], turned[1], 1).motion;
    const Eigen::Vector3d turn = Log(motion.motion.Inverse() * other).head<3>();
    squares += turn * turn.transpose();
  }
  EXPECT_LT((motion.turn_spread - squares).norm(), 1e-3 * squares.norm());
}

}  // namespace
}  // namespace kvx
