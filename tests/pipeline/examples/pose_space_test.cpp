// Pose space: exact at the examples, growing from the template, bounded everywhere.
#include "pipeline/examples/pose_space.h"

#include <gtest/gtest.h>

#include <random>

#include "core/errors.h"

namespace kvx {
namespace {

Joint JointWith(int child, int parent, int dofs, std::vector<int> drivers = {}) {
  Joint joint{.child = child, .parent = parent, .drivers = std::move(drivers)};
  joint.dofs.resize(dofs);
  return joint;
}

// Root, one joint with one degree of freedom, and a kneecap that follows it.
SkeletonFit KneeAt(const std::vector<double>& degrees) {
  SkeletonFit fit;
  fit.skeleton.joints = {JointWith(0, kNoParent, 0), JointWith(1, 0, 1), JointWith(2, 0, 0, {1})};
  for (const double d : degrees) fit.scan_angles.push_back(JointAngles::Constant(1, RadFromDeg(d)));
  return fit;
}

// A palm with two fingers of two joints each: 3 degrees of freedom a finger.
SkeletonFit HandAt(const std::vector<JointAngles>& angles) {
  SkeletonFit fit;
  fit.skeleton.joints = {JointWith(0, kNoParent, 0), JointWith(1, 0, 2), JointWith(2, 1, 1),
                         JointWith(3, 0, 2), JointWith(4, 3, 1)};
  fit.scan_angles = angles;
  return fit;
}

std::vector<JointAngles> RandomAngles(int scans, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(-0.3, 1.4);
  std::vector<JointAngles> out(scans, JointAngles(6));
  for (JointAngles& a : out) {
    for (double& value : a) value = angle(random);
  }
  return out;
}

const PoseSpaceOptions kAllOptions[] = {{PoseBasis::kRbf, false},
                                        {PoseBasis::kRbf, true},
                                        {PoseBasis::kNormalised, false},
                                        {PoseBasis::kNormalised, true}};

TEST(PoseSpace, IsExactAtEveryScanAndNothingAtTheTemplate) {
  for (const PoseSpaceOptions& options : kAllOptions) {
    for (const int scans : {1, 3, 9, 14}) {
      const SkeletonFit fit = HandAt(RandomAngles(scans, 7u + unsigned(scans)));
      const PoseSpace space(fit, options);
      for (int k = 0; k < scans; ++k) {
        Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(5, scans);
        unit.col(k).setOnes();
        EXPECT_LT((space.Coefficients(fit.scan_angles[k]) - unit).cwiseAbs().maxCoeff(), 1e-9)
            << scans << " scans, " << k;
        EXPECT_EQ(space.Extrapolation(fit.scan_angles[k]).maxCoeff(), 0);
      }
      EXPECT_LT(space.Coefficients(JointAngles::Zero(6)).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

double AtDegrees(const PoseSpace& space, double degrees, int scan = 0) {
  return space.Coefficients(JointAngles::Constant(1, RadFromDeg(degrees)))(1, scan);
}

// One scan at angle s: c(a) = k(a, s) / k(s, s) with k(a, b) = a b + min(a,
// b) + 0.1 (e(|a - b|) - e(a) e(b)), e(r) = exp(-20 r).
TEST(PoseSpace, OneScanHasTheClosedForm) {
  const auto near = [](double r) { return std::exp(-20 * r); };
  const auto k = [&](double a, double b) {
    return a * b + std::min(a, b) + 0.1 * (near(std::abs(a - b)) - near(a) * near(b));
  };
  const PoseSpace space(KneeAt({60}));
  for (const double d : {0.0, 15.0, 30.0, 58.0, 60.0, 70.0}) {
    EXPECT_NEAR(AtDegrees(space, d), k(RadFromDeg(d), RadFromDeg(60)) / k(RadFromDeg(60), RadFromDeg(60)),
                1e-9)
        << d;
  }
  EXPECT_NEAR(AtDegrees(space, 75), AtDegrees(space, 300), 1e-12)
      << "growth ends a quarter of the range beyond";
  EXPECT_NEAR(AtDegrees(space, -15), AtDegrees(space, -200), 1e-12);
}

TEST(PoseSpace, TwoScansOfNearlyTheSamePoseAreAveragedAwayFromThem) {
  const PoseSpace space(KneeAt({50, 50.5}));
  EXPECT_NEAR(AtDegrees(space, 50, 0), 1, 1e-9);
  EXPECT_NEAR(AtDegrees(space, 50, 1), 0, 1e-9);
  EXPECT_NEAR(AtDegrees(space, 50.25, 0), AtDegrees(space, 50.25, 1), 0.02);
  const double below = AtDegrees(space, 30, 0), above = AtDegrees(space, 30, 1);
  EXPECT_GT(below, 0.15);
  EXPECT_GT(above, 0.15) << "no scan is thrown away, none is turned against the other";
}

TEST(PoseSpace, SharesOfScanAndTemplateMeetHalfWay) {
  const PoseSpace space(KneeAt({60}), {PoseBasis::kNormalised, false});
  EXPECT_NEAR(AtDegrees(space, 30), 0.5, 1e-9);
  for (double d = -15; d <= 75; d += 5) {
    EXPECT_NEAR(AtDegrees(space, d) + AtDegrees(space, 60 - d), 1, 1e-9) << "the two add up to 1 everywhere";
  }
}

TEST(PoseSpace, GlobalSpacesLookAtEveryAngle) {
  const std::vector<JointAngles> scans = RandomAngles(6, 3);
  const PoseSpace space(HandAt(scans), {PoseBasis::kRbf, true});
  JointAngles other_finger = scans[2];
  other_finger.tail(3).array() += 0.4;
  const Eigen::MatrixXd c = space.Coefficients(other_finger);
  EXPECT_GT(std::abs(c(1, 2) - 1), 0.01);
  for (int bone = 1; bone < 5; ++bone) EXPECT_TRUE(c.row(bone).isApprox(c.row(0), 1e-12));
}

TEST(PoseSpace, KnowsItsBasesByName) {
  EXPECT_EQ(PoseBasisFromName("rbf"), PoseBasis::kRbf);
  EXPECT_EQ(PoseBasisFromName("normalised"), PoseBasis::kNormalised);
  EXPECT_THROW(PoseBasisFromName("cubic"), InputError);
}

TEST(PoseSpace, ABoneLooksAtItsOwnNeighbourhood) {
  const std::vector<JointAngles> scans = RandomAngles(6, 3);
  const PoseSpace space(HandAt(scans));
  JointAngles other_finger = scans[2];
  other_finger.tail(3).array() += 0.4;
  const Eigen::MatrixXd c = space.Coefficients(other_finger);
  for (const int bone : {1, 2}) {
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(c(bone, k), k == 2, 1e-9);
  }
  EXPECT_GT(std::abs(c(3, 2) - 1), 0.01);
}

TEST(PoseSpace, ScansThatLookTheSameShareTheirCoefficient) {
  const PoseSpace space(KneeAt({40, 40, 80, 0}));
  const Eigen::MatrixXd c = space.Coefficients(JointAngles::Constant(1, RadFromDeg(40)));
  EXPECT_TRUE(c.row(1).isApprox(Eigen::RowVector4d(0.5, 0.5, 0, 0), 1e-9)) << c;
  EXPECT_LT(space.Coefficients(JointAngles::Zero(1)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(PoseSpace, StaysBoundedFarFromTheExamples) {
  const PoseSpace space(HandAt(RandomAngles(10, 11)));
  for (const JointAngles& direction : RandomAngles(200, 12)) {
    for (const double far : {1.0, 5.0, 100.0}) {
      const JointAngles at = far * direction;
      const Eigen::MatrixXd c = space.Coefficients(at);
      EXPECT_LT(c.cwiseAbs().maxCoeff(), 2.0);
      EXPECT_LT(c.cwiseAbs().rowwise().sum().maxCoeff(), 6.0);
    }
  }
}

TEST(PoseSpace, ExtrapolationCountsExampleDistancesBeyondTheHull) {
  const PoseSpace space(KneeAt({30, 60}));  // examples 0, 30, 60: 40 degrees apart on average
  const auto at = [&](double degrees) {
    return space.Extrapolation(JointAngles::Constant(1, RadFromDeg(degrees)))[1];
  };
  EXPECT_EQ(at(45), 0);
  EXPECT_NEAR(at(100), 1, 1e-3);
  EXPECT_NEAR(at(-20), 0.5, 1e-3);
}

TEST(PoseSpace, WithoutDegreesOfFreedomNothingIsAdded) {
  SkeletonFit fit;
  fit.skeleton.joints = {JointWith(0, kNoParent, 0)};
  fit.scan_angles = {JointAngles::Zero(0)};
  EXPECT_EQ(PoseSpace(fit).Coefficients(JointAngles::Zero(0))(0, 0), 0);
}

}  // namespace
}  // namespace kvx
