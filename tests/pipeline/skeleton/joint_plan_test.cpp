// Joints of trees and names that are not quite the preset's.
#include "pipeline/skeleton/joint_plan.h"

#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

using Names = std::vector<std::string>;

BoneSet Tree(const std::vector<std::pair<std::string, int>>& bones) {  // name, parent
  BoneSet set;
  for (const auto& [name, parent] : bones)
    set.bones.push_back({.label = int(set.bones.size()) + 1, .name = name, .parent = parent});
  return set;
}

std::vector<JointPlan> Knee(const std::vector<std::pair<std::string, int>>& bones) {
  return PlanJoints(Tree(bones), Region::kKnee, {});
}

TEST(PlanJoints, NamesCountInAnyCase) {
  const auto plans = Knee({{"Femur", kNoParent}, {"TIBIA", 0}, {"Patella", 0}});
  EXPECT_EQ(plans[1].dofs, Names{"flexion"});
  EXPECT_TRUE(plans[2].dofs.empty());
  EXPECT_EQ(plans[2].driver, "TIBIA");
}

TEST(PlanJoints, AKneeThatHangsOnItsTibiaBendsAsWell) {
  const auto plans = Knee({{"tibia", kNoParent}, {"femur", 0}, {"fibula", 0}, {"patella", 1}});
  EXPECT_EQ(plans[1].dofs, Names{"flexion"});
  EXPECT_EQ(plans[2].driver, "femur") << "whose joint is that of tibia and femur";
  EXPECT_EQ(plans[3].driver, "femur");
}

TEST(PlanJoints, ABoneThatThePresetDoesNotKnowTurnsFreely) {
  const auto plans = Knee({{"femur", kNoParent}, {"tibia", 0}, {"fabella", 0}});
  EXPECT_EQ(plans[1].dofs, Names{"flexion"});
  EXPECT_EQ(plans[2].dofs, (Names{"flexion", "abduction", "rotation"}));
}

TEST(PlanJoints, NamingOneJointLeavesTheOthersAsThePresetHasThem) {
  const BoneSet bones =
      Tree({{"femur", kNoParent}, {"Tibia", 0}, {"fibula", 1}, {"patella", 0}, {"other", 1}});
  const auto plans = PlanJoints(bones, Region::kKnee, {{"patella", {"tilt"}}});
  EXPECT_EQ(plans[1].dofs, Names{"flexion"});
  EXPECT_EQ(plans[2].driver, "Tibia");
  EXPECT_TRUE(plans[2].dofs.empty());
  EXPECT_EQ(plans[3].dofs, Names{"tilt"});
  EXPECT_TRUE(plans[4].dofs.empty()) << "unknown to the preset and to the list";
  EXPECT_TRUE(PlanJoints(bones, Region::kKnee, {{"Tibia", {}}})[1].dofs.empty()) << "fixed on request";
}

// By names in any case, and as the study's tree has the joint above.
TEST(PlanJoints, AThumbsAxesAreNearParallel) {
  const BoneSet bones =
      Tree({{"carpals", kNoParent}, {"MC_thumb", 0}, {"other", 0}, {"PP_thumb", 1}, {"dp_thumb", 3}});
  const auto plans = PlanJoints(bones, Region::kHand, {});
  EXPECT_TRUE(plans[1].parallel.empty());
  ASSERT_EQ(plans[3].parallel.size(), 1);
  EXPECT_EQ(plans[3].parallel[0].bone, 1);
  EXPECT_NEAR(DegFromRad(plans[3].parallel[0].spread_rad), 20, 1e-9);
  EXPECT_FALSE(plans[3].parallel[0].learnt);
  ASSERT_EQ(plans[4].parallel.size(), 1);
  EXPECT_EQ(plans[4].parallel[0].bone, 3);
  EXPECT_NEAR(DegFromRad(plans[4].parallel[0].spread_rad), 5, 1e-9);
  EXPECT_TRUE(plans[4].parallel[0].learnt);
}

TEST(PlanJoints, KnucklesStandInARow) {
  const BoneSet bones =
      Tree({{"carpals", kNoParent}, {"pp_little", 0}, {"pp_ring", 0}, {"mp_ring", 2}, {"pp_index", 0}});
  const auto plans = PlanJoints(bones, Region::kHand, {});
  ASSERT_EQ(plans[1].parallel.size(), 1);
  EXPECT_EQ(plans[1].parallel[0].bone, 2);
  EXPECT_NEAR(DegFromRad(plans[1].parallel[0].spread_rad), 15, 1e-9);
  EXPECT_NEAR(DegFromRad(plans[1].parallel[0].along_rad), 20, 1e-9);
  EXPECT_FALSE(plans[1].parallel[0].learnt);
  EXPECT_TRUE(plans[2].parallel.empty()) << "the bone before is not there";
  EXPECT_EQ(plans[3].parallel[0].along_rad, 0) << "in no row";
  EXPECT_TRUE(plans[4].parallel.empty()) << "the first";
}

// Fixed means fixed: it does not go on following the tibia.
TEST(PlanJoints, ADependentBoneThatIsListedFollowsNoOther) {
  const BoneSet bones = Tree({{"femur", kNoParent}, {"tibia", 0}, {"fibula", 1}, {"patella", 0}});
  const auto plans = PlanJoints(bones, Region::kKnee, {{"patella", {}}});
  EXPECT_TRUE(plans[3].dofs.empty());
  EXPECT_EQ(plans[3].driver, "");
  EXPECT_EQ(plans[2].driver, "tibia") << "not listed";
  EXPECT_EQ(PlanJoints(bones, Region::kKnee, {{"patella", {"tilt"}}})[3].driver, "");
}

TEST(PlanJoints, InACustomRegionTheListSaysAllThatMoves) {
  const BoneSet bones = Tree({{"femur", kNoParent}, {"tibia", 0}, {"patella", 0}});
  const auto plans = PlanJoints(bones, Region::kCustom, {{"patella", {"tilt"}}});
  EXPECT_TRUE(plans[1].dofs.empty());
  EXPECT_EQ(plans[2].dofs, Names{"tilt"});
}

TEST(PlanJoints, TheRootHasNoJoint) {
  const BoneSet bones = Tree({{"femur", kNoParent}, {"tibia", 0}});
  EXPECT_THROW(PlanJoints(bones, Region::kKnee, {{"femur", {"flexion"}}}), InputError);
  EXPECT_THROW(PlanJoints(bones, Region::kKnee, {{"hip", {"flexion"}}}), InputError);
}

TEST(PlanJoints, WhatTheStudySaysCounts) {
  const BoneSet bones = Tree({{"tibia", kNoParent}, {"femur", 0}, {"other", 0}});
  const auto plans = PlanJoints(bones, Region::kKnee, {{"femur", {"bend", "twist"}}});
  EXPECT_EQ(plans[1].dofs, (Names{"bend", "twist"}));
  EXPECT_TRUE(plans[2].dofs.empty());
}

}  // namespace
}  // namespace kvx
