// What bones lose where two of them claim one place.
#include "pipeline/bones/search/plausibility.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

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
