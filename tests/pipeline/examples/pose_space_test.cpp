// Pose space: exact at the examples, growing from the template, bounded everywhere.
#include "pipeline/examples/pose_space.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// One scan at angle s: c(a) = k(a, s) / k(s, s) with
// k(a, b) = (a b + min(a, b)) / (s^2 + s) + 0.03 (e(|a - b|) - e(a) e(b)), e(r) = 2 exp(-20 r) - exp(-40 r).
TEST(PoseSpace, OneScanHasTheClosedForm) {
  const double s = RadFromDeg(60);
  const auto near = [](double r) { return 2 * std::exp(-20 * r) - std::exp(-40 * r); };
  const auto k = [&](double a) {
    return (a * s + std::min(a, s)) / (s * s + s) + 0.03 * (near(std::abs(a - s)) - near(a) * near(s));
  };
  const PoseSpace space(KneeAt({60}));
  for (const double d : {0.0, 15.0, 30.0, 58.0, 60.0, 70.0})
    EXPECT_NEAR(AtDegrees(space, d), k(RadFromDeg(d)) / k(s), 1e-9) << d;
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

// Scans of about 40 degrees and one of 80, of displacements that grow with the angle and some noise; those of
// the second scan are larger than that by a factor.
PoseSpace TwiceAbout40(double apart_deg, double larger, double noise_mm2 = 0.1) {
  const Eigen::Vector3d mm(3, 3 * larger, 6);
  const Eigen::Matrix3d moments = mm * mm.transpose() + noise_mm2 * Eigen::Matrix3d::Identity();
  return PoseSpace(KneeAt({40, 40 + apart_deg, 80}), {}, {std::vector<Eigen::MatrixXd>(3, moments), {}});
}

TEST(PoseSpace, TwoScansOfNearlyTheSamePoseAreNotTurnedAgainstEachOther) {
  for (const auto& [larger, noise_mm2] : {std::pair(1.0, 0.1), {1.05, 0.1}, {1.5, 0.1}, {1.5, 3.0}}) {
    for (const double apart_deg : {0.001, 0.01, 0.11, 0.3, 1.0, 3.0}) {
      const PoseSpace space = TwiceAbout40(apart_deg, larger, noise_mm2);
      for (double d = -5; d < 90; d += 0.05) {
        const Eigen::MatrixXd c = space.Coefficients(JointAngles::Constant(1, RadFromDeg(d)));
        EXPECT_GT(c.row(1).minCoeff(), -0.1) << apart_deg << " apart, at " << d;
        EXPECT_LT(c.row(1).maxCoeff(), 1.1) << apart_deg << " apart, at " << d;
      }
    }
  }
}

TEST(PoseSpace, PosesThatBonesDoNotTellApartAreOne) {
  const PoseSpace space = TwiceAbout40(0.09, 1.05);
  EXPECT_NEAR(AtDegrees(space, 40, 0), 0.5, 1e-9);
  EXPECT_NEAR(AtDegrees(space, 40, 1), 0.5, 1e-9);
  EXPECT_NEAR(AtDegrees(space, 40.09, 0) + AtDegrees(space, 40.09, 1), 1, 0.02) << "a mean of both here too";
  for (double d = -5; d < 90; d += 0.5)
    EXPECT_NEAR(AtDegrees(space, d, 0), AtDegrees(space, d, 1), 1e-9) << d;
  const PoseSpace told_apart = TwiceAbout40(0.11, 1.05);
  EXPECT_NEAR(AtDegrees(told_apart, 40, 0), 1, 1e-9);
  EXPECT_NEAR(AtDegrees(told_apart, 40.11, 1), 1, 1e-9);
}

TEST(PoseSpace, ARepeatOfTheTemplateAddsNothing) {
  const PoseSpace space(KneeAt({-0.05, 40})), without(KneeAt({40}));
  for (double d = -5; d < 60; d += 0.5) {
    EXPECT_NEAR(AtDegrees(space, d, 0), 0, 1e-9) << d;
    EXPECT_NEAR(AtDegrees(space, d, 1), AtDegrees(without, d), 0.02) << d;
  }
  EXPECT_NEAR(AtDegrees(space, 40, 1), 1, 1e-9);
}

// Around repeats of a scan and of the template, 0.002 degrees at a time. Two poses that are barely told apart
// take turns within 0.11 degrees.
TEST(PoseSpace, NothingJumpsWhereAPoseWasScannedTwice) {
  for (const double apart_deg : {0.0, 0.001, 0.01, 0.09, 0.11, -39.95}) {
    const PoseSpace space = TwiceAbout40(apart_deg, 1.5);
    const double most = apart_deg == 0.11 ? 0.03 : 0.002;
    for (double d = -0.5; d<40.5; d += d> 0.5 && d < 39.5 ? 0.5 : 0.002) {
      for (const int scan : {0, 1, 2})
        EXPECT_NEAR(AtDegrees(space, d, scan), AtDegrees(space, d + 0.002, scan), most)
            << apart_deg << ", " << d;
    }
  }
}

// Of three repeats the middle one is within 0.1 degrees of both others, which are not of each other.
TEST(PoseSpace, TheOrderOfScansDoesNotMatter) {
  const std::vector<double> degrees{40, 40.08, 40.16, 70};
  std::vector<int> order{0, 1, 2, 3};
  for (const PoseSpaceOptions& options : kAllOptions) {
    const PoseSpace space(KneeAt(degrees), options);
    do {
      std::vector<double> reordered;
      for (const int k : order) reordered.push_back(degrees[size_t(k)]);
      const PoseSpace other(KneeAt(reordered), options);
      for (const double at : {-10.0, 20.0, 39.0, 40.0, 40.08, 40.12, 40.16, 41.0, 55.0, 90.0}) {
        const JointAngles angles = JointAngles::Constant(1, RadFromDeg(at));
        const Eigen::MatrixXd expected = space.Coefficients(angles)(Eigen::all, order);
        EXPECT_LT((other.Coefficients(angles) - expected).cwiseAbs().maxCoeff(), 1e-9) << at;
      }
    } while (std::ranges::next_permutation(order).found);
  }
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

// Three scans of one pose have one covariance c with each other. What a known one says is all; of two that
// are half known, with errors of variance c, each is a third.
TEST(PoseSpace, WhatIsLessKnownCountsLess) {
  const PoseSpace space(KneeAt({60, 60, 60}));
  EXPECT_LT((space.CoefficientsOfOthers(1, 2, Eigen::Vector3d(1, 0.5, 0)) - Eigen::Vector3d(1, 0, 0)).norm(),
            1e-9);
  EXPECT_LT(
      (space.CoefficientsOfOthers(1, 2, Eigen::Vector3d(0.5, 0.5, 0)) - Eigen::Vector3d(1, 1, 0) / 3).norm(),
      1e-9);
  EXPECT_EQ(space.CoefficientsOfOthers(1, 2, Eigen::Vector3d(0, 0, 1)), Eigen::Vector3d::Zero());
}

TEST(PoseSpace, AScanThatHidesABoneDoesNotWidenItsJointsRange) {
  ExampleMoments moments{std::vector<Eigen::MatrixXd>(3, Eigen::Matrix3d::Identity())};
  const PoseSpace wide(KneeAt({30, 60, 150}), {}, moments);
  EXPECT_GT(std::abs(AtDegrees(wide, 100, 1) - AtDegrees(wide, 120, 1)), 1e-3);
  moments.hidden = Eigen::MatrixXi::Zero(3, 3);
  moments.hidden(1, 2) = 1;
  const PoseSpace space(KneeAt({30, 60, 150}), {}, moments);
  EXPECT_NEAR(AtDegrees(space, 75, 1), AtDegrees(space, 120, 1), 1e-12) << "a quarter beyond 60";
  EXPECT_GT(space.Extrapolation(JointAngles::Constant(1, RadFromDeg(120)))[1], 0);
}

// One joint whose bone no scan shows, one that a scan alone does not show, and is said to stand far off
// there.
TEST(PoseSpace, IsExactAtScansThatHideBones) {
  std::vector<JointAngles> angles = RandomAngles(4, 3);
  angles[1][2] = RadFromDeg(-140);
  const SkeletonFit fit = HandAt(angles);
  ExampleMoments moments{std::vector<Eigen::MatrixXd>(5, Eigen::Matrix4d::Identity())};
  moments.hidden = Eigen::MatrixXi::Zero(5, 4);
  moments.hidden.row(4).setOnes();
  moments.hidden(2, 1) = 1;
  for (const PoseSpaceOptions& options : kAllOptions) {
    const PoseSpace space(fit, options, moments);
    for (int k = 0; k < 4; ++k) {
      Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(5, 4);
      unit.col(k).setOnes();
      EXPECT_LT((space.Coefficients(fit.scan_angles[k]) - unit).cwiseAbs().maxCoeff(), 1e-9) << k;
      if (k == 1) continue;  // said to stand far outside what the others show
      EXPECT_LT(space.Extrapolation(fit.scan_angles[k]).cwiseAbs().maxCoeff(), 1e-9) << k;
    }
  }
}

TEST(PoseSpace, KnowsItsBasesByName) {
  EXPECT_EQ(PoseBasisFromName("rbf"), PoseBasis::kRbf);
  EXPECT_EQ(PoseBasisFromName("normalised"), PoseBasis::kNormalised);
  EXPECT_THROW(PoseBasisFromName("cubic"), InputError);
}

// Moments of displacements of three components that are the given function of a pose, the same near every
// bone.
template <class F>
ExampleMoments MomentsOf(const std::vector<JointAngles>& scans, F&& displacement_mm) {
  Eigen::MatrixX3d d(scans.size(), 3);
  for (size_t k = 0; k < scans.size(); ++k) d.row(Eigen::Index(k)) = displacement_mm(scans[k]);
  return {std::vector<Eigen::MatrixXd>(5, d * d.transpose() / 3)};
}

// What bone 1's coefficients make of the scans' displacements, less what it should be: worst of some poses.
template <class F>
double WorstError(const PoseSpace& space, const std::vector<JointAngles>& scans,
                  const std::vector<JointAngles>& poses, F&& displacement_mm) {
  double worst = 0;
  for (const JointAngles& pose : poses) {
    Eigen::RowVector3d found = Eigen::RowVector3d::Zero();
    const Eigen::MatrixXd c = space.Coefficients(pose);
    for (size_t k = 0; k < scans.size(); ++k) found += c(1, Eigen::Index(k)) * displacement_mm(scans[k]);
    worst = std::max(worst, (found - displacement_mm(pose)).norm());
  }
  return worst;
}

std::vector<JointAngles> HalfWay(const std::vector<JointAngles>& scans) {
  std::vector<JointAngles> out;
  for (size_t k = 1; k < scans.size(); ++k) out.push_back(0.5 * (scans[k] + scans[k - 1]));
  return out;
}

Eigen::RowVector3d Linear(const JointAngles& a) { return {a[0] - 2 * a[2], 3 * a[2], 0.5 * a[1]}; }
Eigen::RowVector3d OfTheOtherFinger(const JointAngles& a) { return {2 * a[5], a[5] - a[4], a[3]}; }

TEST(PoseSpace, GivesBackWhatGrowsLinearlyWithTheAngles) {
  const std::vector<JointAngles> scans = RandomAngles(12, 5);
  const PoseSpace space(HandAt(scans), {}, MomentsOf(scans, Linear));
  EXPECT_LT(WorstError(space, scans, HalfWay(scans), Linear), 0.15) << "of up to 4";
  EXPECT_LT(WorstError(space, scans, scans, Linear), 1e-8);
}

TEST(PoseSpace, LearnsThatADistantJointMovesTheTissue) {
  const std::vector<JointAngles> scans = RandomAngles(12, 5);
  const SkeletonFit fit = HandAt(scans);
  const double assumed = WorstError(PoseSpace(fit), scans, HalfWay(scans), OfTheOtherFinger),
               learned = WorstError(PoseSpace(fit, {}, MomentsOf(scans, OfTheOtherFinger)), scans,
                                    HalfWay(scans), OfTheOtherFinger);
  EXPECT_LT(learned, 0.4 * assumed);
  EXPECT_LT(learned, 0.4);
}

TEST(PoseSpace, ABoneLooksAtItsOwnNeighbourhoodFirst) {
  const std::vector<JointAngles> scans = RandomAngles(6, 3);
  const PoseSpace space(HandAt(scans));
  JointAngles other_finger = scans[2], own_finger = scans[2];
  other_finger.tail(3).array() += 0.4;
  own_finger.head(3).array() += 0.4;
  const auto change = [&](const JointAngles& at, int bone) {
    return (space.Coefficients(at).row(bone) - Eigen::RowVectorXd::Unit(6, 2)).norm();
  };
  for (const int bone : {1, 2}) EXPECT_LT(change(other_finger, bone), 0.6 * change(own_finger, bone));
  for (const int bone : {3, 4}) EXPECT_LT(change(own_finger, bone), 0.6 * change(other_finger, bone));
}

TEST(PoseSpace, ChangesLittleWithALittleMotion) {
  const std::vector<JointAngles> scans = RandomAngles(9, 21);
  const PoseSpace space(HandAt(scans), {}, MomentsOf(scans, Linear));
  for (const JointAngles& pose : scans) {  // where the scans' own parts are steepest
    const JointAngles beside = pose.array() + 1e-6;
    EXPECT_LT((space.Coefficients(beside) - space.Coefficients(pose)).cwiseAbs().maxCoeff(), 1e-3);
  }
}

// By how much the speed of any coefficient changes, per degree, where a motion in a direction passes a scan.
// What is left of it is that of wandering.
double JoltAt(const PoseSpace& space, const JointAngles& scan, const JointAngles& direction) {
  const JointAngles step = RadFromDeg(0.1) * direction.normalized();
  const Eigen::MatrixXd before = space.Coefficients(scan) - space.Coefficients(scan - step),
                        after = space.Coefficients(scan + step) - space.Coefficients(scan);
  return (after - before).cwiseAbs().maxCoeff() / 0.1;
}

TEST(PoseSpace, AMotionKeepsItsSpeedAsItPassesAScan) {
  const SkeletonFit knee = KneeAt({27, 48, 78});
  for (const JointAngles& scan : knee.scan_angles)
    EXPECT_LT(JoltAt(PoseSpace(knee), scan, JointAngles::Ones(1)), 0.1) << DegFromRad(scan[0]);
  const std::vector<JointAngles> scans = RandomAngles(9, 21);
  const PoseSpace hand(HandAt(scans), {}, MomentsOf(scans, Linear));
  for (const JointAngles& scan : scans) {
    for (const JointAngles& direction : RandomAngles(3, 4))
      EXPECT_LT(JoltAt(hand, scan, direction), 0.15) << scan.transpose();
  }
}

TEST(PoseSpace, MomentsWithoutSizeTeachNothing) {
  const std::vector<JointAngles> scans = RandomAngles(4, 8);
  const PoseSpace plain(HandAt(scans)),
      taught(HandAt(scans), {}, {std::vector<Eigen::MatrixXd>(5, Eigen::MatrixXd::Zero(4, 4))});
  const JointAngles at = RandomAngles(1, 9)[0];
  EXPECT_EQ(plain.Coefficients(at), taught.Coefficients(at));
}

TEST(PoseSpace, OneMoreScanIsKnownFromThenOn) {
  const std::vector<JointAngles> scans = RandomAngles(5, 13);
  const PoseSpace space(HandAt(scans), {}, MomentsOf(scans, Linear));
  const JointAngles next = RandomAngles(1, 14)[0];
  const PoseSpace more = space.With(next);
  EXPECT_GT(space.Uncertainty(next).minCoeff(), 0.05);
  EXPECT_LT(more.Uncertainty(next).maxCoeff(), 1e-3);
  EXPECT_NEAR(more.Coefficients(next)(2, 5), 1, 1e-9);
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
