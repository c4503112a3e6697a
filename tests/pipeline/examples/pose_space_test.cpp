// Pose space: exact at the examples, piecewise linear along one joint, bounded everywhere.
#include "pipeline/examples/pose_space.h"

#include <gtest/gtest.h>

#include <random>

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

TEST(PoseSpace, IsExactAtEveryScanAndNothingAtTheTemplate) {
  for (const int scans : {1, 3, 9, 14}) {
    const SkeletonFit fit = HandAt(RandomAngles(scans, 7u + unsigned(scans)));
    const PoseSpace space(fit);
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

TEST(PoseSpace, OneJointIsPiecewiseLinear) {
  const std::vector<double> knots{0, 25, 50, 80};
  const PoseSpace space(KneeAt({25, 50, 80}));
  for (double d = -20; d <= 120; d += 2.5) {
    const Eigen::MatrixXd c = space.Coefficients(JointAngles::Constant(1, RadFromDeg(d)));
    const double at = std::clamp(d, 0.0, 80.0);  // constant beyond the examples
    for (int k = 0; k < 3; ++k) {
      const double lower = knots[k], here = knots[k + 1], upper = k < 2 ? knots[k + 2] : 1e9;
      const double oracle = at <= here ? std::max(0.0, (at - lower) / (here - lower))
                                       : std::max(0.0, (upper - at) / (upper - here));
      for (int bone = 0; bone < 3; ++bone)
        EXPECT_NEAR(c(bone, k), oracle, 1e-7) << d << " degrees, bone " << bone;
    }
  }
}

TEST(PoseSpace, OneScanGrowsLinearlyFromTheTemplate) {
  const PoseSpace space(KneeAt({60}));
  for (const double d : {0.0, 15.0, 30.0, 60.0}) {
    EXPECT_NEAR(space.Coefficients(JointAngles::Constant(1, RadFromDeg(d)))(1, 0), d / 60, 1e-9);
  }
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
  EXPECT_LT(c(3, 2), 0.99);
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
      EXPECT_LT(c.cwiseAbs().maxCoeff(), 1.5);
      EXPECT_LT(c.cwiseAbs().rowwise().sum().maxCoeff(), 3.5);
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
