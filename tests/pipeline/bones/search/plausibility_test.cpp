// What joints, gaps and turns cost, and what bones lose where two of them claim one place.
#include "pipeline/bones/search/plausibility.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

// 20 mm along x, 10 mm thick.
BoneShape LongBone() {
  BoneShape bone;
  bone.centroid_mm.setZero();
  bone.axes.setIdentity();
  bone.extent_mm = {20, 10, 10};
  bone.length_mm = 20, bone.thickness_mm = 10;
  return bone;
}

// All that lies below `x_mm` along x: its distances are a ramp, which is read exactly between voxels.
BoneShape BoneBelow(double x_mm) {
  BoneShape bone = LongBone();
  bone.distance_mm = Volume(Box({41, 41, 41}, {1, 1, 1}, Eigen::Matrix3d::Identity()));
  const Grid& grid = bone.distance_mm.grid;
  for (size_t v = 0; v < bone.distance_mm.values.size(); ++v)
    bone.distance_mm.values[v] = float(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps.x() - x_mm);
  return bone;
}

RigidTransform Moved(double x_mm) { return {.translation_mm = {x_mm, 0, 0}}; }

RigidTransform Turned(const Eigen::Vector3d& axis, double angle_rad) {
  return RotationAbout(PointMm{Eigen::Vector3d::Zero()}, axis, angle_rad);
}

TEST(JointState, TellsTheTwistOfALongBoneApart) {
  const BoneShape bone = LongBone();
  const JointState twisted = JointStateOf(bone, {}, {}, Turned(Eigen::Vector3d::UnitX(), 0.4));
  EXPECT_NEAR(twisted.rotation_rad, 0.4, 1e-12);
  EXPECT_NEAR(twisted.twist_rad, 0.4, 1e-12);
  const JointState bent = JointStateOf(bone, {}, {}, Turned(Eigen::Vector3d::UnitY(), 0.4));
  EXPECT_NEAR(bent.rotation_rad, 0.4, 1e-12);
  EXPECT_NEAR(bent.twist_rad, 0, 1e-12);
  BoneShape round = bone;
  round.thickness_mm = 15;
  EXPECT_EQ(JointStateOf(round, {}, {}, Turned(Eigen::Vector3d::UnitX(), 0.4)).twist_rad, 0);
}

TEST(JointState, ShiftsByWhatItsStillestPivotDoes) {
  const RigidTransform parent = Turned({1, 2, 3}, 0.7), turn = Turned(Eigen::Vector3d::UnitZ(), kPi / 2);
  const JointShape two_pivots{.pivots_mm = {{3, 0, 0}, {2, 0, 0}}};
  EXPECT_NEAR(JointStateOf(LongBone(), two_pivots, parent, parent * turn).shift_mm, std::sqrt(8.0), 1e-12);
  EXPECT_NEAR(JointStateOf(LongBone(), two_pivots, parent, parent * Moved(-5)).shift_mm, 5, 1e-12);
  EXPECT_NEAR(JointStateOf(LongBone(), two_pivots, parent, parent).rotation_rad, 0, 1e-7);
  EXPECT_EQ(JointStateOf(LongBone(), {}, parent, parent * Moved(-5)).shift_mm, 0) << "it has no pivots";
}

TEST(JointNats, AreASquareOfTheTurnsAndALogarithmOfTheShift) {
  const BoneShape bone = LongBone();
  EXPECT_EQ(JointNats({}, bone), 0);
  EXPECT_NEAR(JointNats({.rotation_rad = RadFromDeg(60)}, bone), -0.5, 1e-12);
  EXPECT_NEAR(JointNats({.rotation_rad = RadFromDeg(30), .twist_rad = RadFromDeg(30)}, bone), -0.625, 1e-12);
  EXPECT_NEAR(JointNats({.shift_mm = 2}, bone), -2 * std::log(2.0), 1e-12) << "a fifth of the thickness";
  EXPECT_NEAR(JointNats({.shift_mm = 5}, bone, 3), -2 * std::log(2.0), 1e-12);
  EXPECT_EQ(JointNats({.shift_mm = 2}, bone, 3), 0) << "within what is slack";
}

TEST(RootNats, AreOfTheTurnAlone) {
  EXPECT_EQ(RootNats(Moved(300)), 0);
  EXPECT_NEAR(RootNats(Moved(300) * Turned({1, 2, 3}, RadFromDeg(40))), -0.5, 1e-12);
}

TEST(Gap, ChangesByHowFarTheBonesArePulledApart) {
  BoneShape child = LongBone();
  child.surface_mm = {{6, 1, 0}, {4, -2, 3}, {9, 0, 0}};
  const BoneShape parent = BoneBelow(1);
  const JointShape joint{.gap_mm = 3};
  EXPECT_NEAR(GapChangeMm(child, parent, joint, {}), 0, 1e-6);
  EXPECT_NEAR(GapChangeMm(child, parent, joint, Moved(2)), 2, 1e-6);
  EXPECT_NEAR(GapChangeMm(child, parent, joint, Moved(-5)), -5, 1e-6);
  EXPECT_EQ(GapNats(0, child, 1), 0);
  EXPECT_NEAR(GapNats(-1.8, child, 1), -2 * std::log(2.0), 1e-12) << "a voxel and 0.08 of the thickness";
}

// A bone of four points, of which the other one holds some.
Anatomy FourPointsBesideABone() {
  Anatomy anatomy;
  anatomy.bones = {BoneBelow(0), BoneBelow(-1000)};
  for (const double x : {-3, -1, 1, 3}) anatomy.bones[1].body.push_back({{x, 0, 0}, 5});
  anatomy.bones[0].body.push_back({{-4, 0, 0}, 5});
  return anatomy;
}

TEST(WorstOverlap, IsTheLargestPartThatTwoBonesClaim) {
  const Anatomy anatomy = FourPointsBesideABone();
  const PartialPose placed{RigidTransform{}, std::nullopt};
  EXPECT_EQ(WorstOverlap(anatomy, 1, {}, placed), 0.5);
  EXPECT_EQ(WorstOverlap(anatomy, 1, Moved(2), placed), 0.25);
  EXPECT_EQ(WorstOverlap(anatomy, 1, Moved(2.5), placed), 0) << "no deeper than three quarters of a voxel";
  EXPECT_EQ(WorstOverlap(anatomy, 1, Moved(-40), placed), 0) << "too far apart to be looked at";
  EXPECT_EQ(WorstOverlap(anatomy, 0, {}, {std::nullopt, RigidTransform{}}), 0.5) << "of the other one";
  EXPECT_EQ(WorstOverlap(anatomy, 1, {}, {std::nullopt, std::nullopt}), 0);
}

struct Claims {
  EllipsoidWorld world{kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity())};
  SoughtBones sought = world.SoughtIn(world.template_scan->volume);
  PartialPose placed{RigidTransform{}, std::nullopt};

  // The tip as far towards the base, of which the base's place is worth `at_stake`.
  double Nats(double towards_base_mm, std::span<const double> at_stake = {}) const {
    RigidTransform tip;
    tip.translation_mm = {-towards_base_mm, 0, 0};
    return OverlapNats(sought.anatomy(), sought.independent_samples(), 1, tip, placed, at_stake);
  }
};

TEST(OverlapNats, BonesThatLieApartLoseNothing) { EXPECT_EQ(Claims().Nats(0), 0); }

TEST(OverlapNats, WhatIsClaimedCostsNoMoreThanItsPlaceIsWorth) {
  const Claims claims;
  const double all = claims.Nats(36), some = claims.Nats(18);
  const auto& samples = claims.sought.independent_samples();
  EXPECT_LT(all, some);
  EXPECT_LT(some, -12);
  EXPECT_GE(all, -2 * (samples[0] + samples[1]));
  const double nothing[] = {0, 0}, little[] = {12, 0}, much[] = {1000, 0};
  EXPECT_EQ(claims.Nats(36, nothing), 0) << "a bone that does not match there has nothing to lose";
  EXPECT_EQ(claims.Nats(36, little), -12);
  EXPECT_EQ(claims.Nats(36, much), all);
}

}  // namespace
}  // namespace kvx
