// What an initial pose decides and what it does not, by two normal distributions on paper.
#include "pipeline/bones/refine/pose_hint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pipeline/bones/judge/doubt_bone.h"

namespace kvx {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// 120 x 18 x 18 mm, oblique, away from the origin.
Bone Rod() {
  Bone bone;
  bone.name = "rod";
  bone.centroid.lps = {30, -20, 50};
  bone.box.axes = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  bone.box.extent_mm = {120, 18, 18};
  return bone;
}

const RigidTransform kFound = Exp((Twist() << 0.3, -0.2, 0.4, 5, -8, 3).finished());

RigidTransform Spun(const Bone& bone, double deg, int axis = 0) {
  return kFound * RotationAbout(bone.centroid, bone.box.axes.col(axis), RadFromDeg(deg));
}

// How a bone of revolution is found: all but its turn about its length.
BoneFit KnownTo(const Bone& bone, double spin_deg) {
  BoneFit fit;
  fit.scan_from_template = kFound;
  const Eigen::Vector3d long_axis = bone.box.axes.col(0);
  const double sure = std::pow(RadFromDeg(0.2), 2);
  fit.covariance.topLeftCorner<3, 3>() =
      sure * Eigen::Matrix3d::Identity() +
      (std::pow(RadFromDeg(spin_deg), 2) - sure) * long_axis * long_axis.transpose();
  fit.covariance.bottomRightCorner<3, 3>() = 0.01 * Eigen::Matrix3d::Identity();
  return fit;
}

double ApartDeg(const RigidTransform& a, const RigidTransform& b) {
  return DegFromRad((a.Inverse() * b).AngleRad());
}

double SpinSdDeg(const Bone& bone, const BoneFit& fit) {
  const Eigen::Vector3d long_axis = bone.box.axes.col(0);
  return DegFromRad(std::sqrt(long_axis.dot(fit.covariance.topLeftCorner<3, 3>() * long_axis)));
}

// 20 degrees apart; spreads of 20 and 5 degrees leave 20 * 25 / (400 + 25).
TEST(PoseHint, DecidesTheSpinOfABoneOfRevolution) {
  const Bone bone = Rod();
  BoneFit fit = KnownTo(bone, 20);
  WeighHint(bone, Spun(bone, 20), fit);
  EXPECT_NEAR(ApartDeg(fit.scan_from_template, Spun(bone, 20)), 20 * 25 / 425.0, 1e-6);
  EXPECT_NEAR(ApartDeg(fit.scan_from_template, kFound), 20 * 400 / 425.0, 1e-6);
  EXPECT_NEAR(((fit.scan_from_template * bone.centroid).lps - (kFound * bone.centroid).lps).norm(), 0, 1e-9);
  EXPECT_NEAR(SpinSdDeg(bone, fit), std::sqrt(400 * 25 / 425.0), 1e-6);
}

// What the scan says to 0.2 degrees stays: 10 * 0.04 / 25.04 degrees of 10.
TEST(PoseHint, MovesAClearPoseByNextToNothing) {
  const Bone bone = Rod();
  BoneFit fit = KnownTo(bone, 0.2);
  WeighHint(bone, Spun(bone, 10), fit);
  EXPECT_NEAR(ApartDeg(fit.scan_from_template, kFound), 10 * 0.04 / 25.04, 1e-6);
  EXPECT_LT(SpinSdDeg(bone, fit), 0.2);
}

// A shift of 6 mm by a spread of 3 mm in both: half of the way. The hint's is a sixth of 18 mm.
TEST(PoseHint, WeighsShiftsByTheThickness) {
  const Bone bone = Rod();
  BoneFit fit = KnownTo(bone, 1);
  fit.covariance.bottomRightCorner<3, 3>() = 9 * Eigen::Matrix3d::Identity();
  RigidTransform hint = kFound;
  hint.translation_mm += Eigen::Vector3d(0, 6, 0);
  WeighHint(bone, hint, fit);
  const Eigen::Vector3d way = (fit.scan_from_template * bone.centroid).lps - (kFound * bone.centroid).lps;
  EXPECT_NEAR((way - Eigen::Vector3d(0, 3, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR(fit.covariance(3, 3), 4.5, 1e-9);
}

// The rod's ends and sides: turned by 25 degrees about its length they lie 3 mm off, tipped by as much 15 mm.
TEST(PoseHint, SaysNothingOfABoneFoundElsewhere) {
  const Bone bone = Rod();
  EXPECT_TRUE(IsNearHint(bone, Spun(bone, 25), kFound));
  const RigidTransform tipped = Spun(bone, 25, 1);
  EXPECT_FALSE(IsNearHint(bone, tipped, kFound));
  BoneFit fit = KnownTo(bone, 20);
  WeighHint(bone, tipped, fit);
  EXPECT_EQ(RowMajor(fit.scan_from_template), RowMajor(kFound));
  EXPECT_NEAR(SpinSdDeg(bone, fit), 20, 1e-9);
}

TEST(PoseHint, WhoeverGaveOneIsNotToGiveOne) {
  BoneFit fit;
  DoubtBone(fit, "the bone matches the scan only weakly");
  EXPECT_THAT(fit.note, HasSubstr("give an initial pose"));
  TellOfHint(fit);
  EXPECT_THAT(fit.note, AllOf(HasSubstr("the bone matches the scan only weakly"),
                              HasSubstr("where its initial pose has it"), Not(HasSubstr("give an"))));
  fit.note = "the bone may be off";
  TellOfHint(fit);
  EXPECT_EQ(fit.note, "the bone may be off");
}

// 100 mm across all bones: up to 150 mm beyond the scan, along whichever axis.
TEST(PoseHint, MayNotBeMeantFarBeyondTheScan) {
  BoneSet bones;
  for (const double z : {0.0, 40.0}) {
    Bone bone;
    bone.centroid.lps = {24, 0, z + 20};
    bone.box.origin.lps = {0, 0, z + 20};
    bone.box.extent_mm = {48, 36, 40};
    bones.bones.push_back(bone);
  }
  Grid scan;
  scan.size = {11, 21, 31};
  scan.spacing_mm = {1, 1, 2};
  scan.origin.lps = {100, 200, 300};
  const auto meant = [&](const Eigen::Vector3d& centre) {
    return MayBeMeant(bones, {Eigen::Quaterniond::Identity(), centre - bones.bones[1].centroid.lps}, 1, scan);
  };
  EXPECT_TRUE(meant({105, 205, 330}));
  for (const double beyond : {149.0, 151.0}) {
    EXPECT_EQ(meant({110 + beyond, 205, 330}), beyond < 150);
    EXPECT_EQ(meant({105, 200 - beyond, 330}), beyond < 150);
    EXPECT_EQ(meant({100 - 0.6 * beyond, 205, 360 + 0.8 * beyond}), beyond < 150);
  }
}

}  // namespace
}  // namespace kvx
