// Hands and knees of rods and balls, with labels in any order, of either side, turned anyhow.
#include "pipeline/segmentation/names/propose_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "core/errors.h"

namespace kvx {
namespace {

using Names = std::map<int, std::string>;

struct Rod {
  std::string name;
  Eigen::Vector3d from, to;  // mm
  double radius_mm;
};

double DistanceMm(const Rod& rod, const Eigen::Vector3d& x) {
  const Eigen::Vector3d way = rod.to - rod.from;
  const double t = std::clamp((x - rod.from).dot(way) / std::max(way.squaredNorm(), 1e-9), 0.0, 1.0);
  return (x - rod.from - t * way).norm() - rod.radius_mm;
}

// The right hand, palm down, seen from above: x to the thumb's side, y along the fingers.
std::vector<Rod> HandRods() {
  std::vector<Rod> rods{{"carpals", {-9, 0, 0}, {9, 0, 0}, 12}};
  const auto chain = [&](const std::string& finger, Eigen::Vector3d at, const Eigen::Vector3d& way,
                         std::vector<double> lengths) {
    std::vector<std::string> parts{"mc_", "pp_", "mp_", "dp_"};
    if (lengths.size() == 3) parts.erase(parts.begin() + 2);
    for (size_t n = 0; n < lengths.size(); ++n) {
      rods.push_back({parts[n] + finger, at + 5 * way, at + (lengths[n] - 3) * way, 4.0});
      at += (lengths[n] + 3) * way;
    }
  };
  chain("thumb", {21, 4, -2}, Eigen::Vector3d(0.8, 0.6, 0), {32, 24, 18});
  chain("index", {11, 13, 0}, Eigen::Vector3d(0.1, 0.99, 0).normalized(), {50, 32, 22, 16});
  chain("middle", {0, 14, 0}, Eigen::Vector3d(0, 1, 0), {48, 35, 24, 16});
  chain("ring", {-10, 13, 0}, Eigen::Vector3d(-0.1, 0.99, 0).normalized(), {45, 32, 23, 16});
  chain("little", {-19, 10, 0}, Eigen::Vector3d(-0.25, 0.97, 0).normalized(), {42, 26, 18, 15});
  return rods;
}

std::vector<Rod> KneeRods() {
  return {{"femur", {0, 0, 15}, {0, 0, 70}, 12},
          {"tibia", {0, 0, -15}, {0, 0, -62}, 11},
          {"fibula", {17, 6, -20}, {17, 6, -60}, 3},
          {"patella", {0, -20, 8}, {0, -20, 12}, 8}};
}

struct Labelled {
  LabelMap labels;
  Names truth;
};

Labelled Draw(const std::vector<Rod>& rods, const Eigen::Matrix3d& world_from_rods, unsigned seed) {
  std::vector<int> labels;
  for (size_t r = 0; r < rods.size(); ++r) labels.push_back(int(r) + 1);
  std::shuffle(labels.begin(), labels.end(), std::mt19937(seed));
  Grid grid;
  grid.size = {110, 110, 110};
  grid.spacing_mm = {2.9, 2.9, 2.9};
  grid.origin.lps = {-160, -160, -160};
  Labelled out{LabelMap(grid), {}};
  for (size_t v = 0; v < out.labels.values.size(); ++v) {
    const Eigen::Vector3d x =
        world_from_rods.transpose() * grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    for (size_t r = 0; r < rods.size(); ++r) {
      if (DistanceMm(rods[r], x) < 0) out.labels.values[v] = uint16_t(labels[r]);
    }
  }
  for (size_t r = 0; r < rods.size(); ++r) out.truth[labels[r]] = rods[r].name;
  return out;
}

Names NamesIn(const std::vector<ProposedBone>& bones) {
  Names names;
  for (const ProposedBone& bone : bones) names[bone.label] = bone.name;
  return names;
}

Eigen::Matrix3d Turned(double degrees) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
}

TEST(ProposeNames, AHandOfEitherSideTurnedAnyhow) {
  for (const double side : {1.0, -1.0}) {
    const Eigen::Matrix3d mirror = Eigen::Vector3d(side, 1, 1).asDiagonal();
    const Labelled hand = Draw(HandRods(), Turned(side * 35) * mirror, 3);
    const auto bones = ProposeNames(hand.labels, Region::kHand);
    EXPECT_EQ(NamesIn(bones), hand.truth);
    for (const ProposedBone& bone : bones) EXPECT_GE(bone.confidence, kSureName) << bone.name;
    EXPECT_TRUE(NamesInDoubt(bones).empty());
    const auto parent = std::ranges::find(bones, std::string("mp_ring"), &ProposedBone::name)->parent;
    EXPECT_EQ(parent, "pp_ring");
  }
}

TEST(ProposeNames, AKneeWithAndWithoutItsSmallBones) {
  std::vector<Rod> rods = KneeRods();
  for (int left = 4; left >= 2; --left, rods.pop_back()) {
    const Labelled knee = Draw(rods, Turned(left == 4 ? 60 : 10), unsigned(left));
    EXPECT_EQ(NamesIn(ProposeNames(knee.labels, Region::kKnee)), knee.truth) << left << " bones";
  }
}

TEST(ProposeNames, WhatCannotBeToldIsSaid) {
  const std::vector<Rod> rods{{"a", {0, -20, 0}, {0, -70, 0}, 12}, {"b", {0, 20, 0}, {0, 70, 0}, 12}};
  const auto lying = ProposeNames(Draw(rods, Eigen::Matrix3d::Identity(), 1).labels, Region::kKnee);
  EXPECT_LT(lying[0].confidence, kSureName) << "nothing says which end is up";
  EXPECT_EQ(NamesInDoubt(lying).size(), 2u);
  EXPECT_THROW(SurelyNamed(lying), InputError);
  const Labelled hand = Draw(HandRods(), Turned(0), 1);
  for (const Region region : {Region::kKnee, Region::kCustom}) {
    const auto bones = ProposeNames(hand.labels, region);
    EXPECT_EQ(bones.size(), 20u);
    EXPECT_TRUE(bones[0].name.empty()) << "no preset with so many bones";
  }
}

TEST(NamesByNumber, ALabelThatLooksLikeAnotherBoneIsPointedOut) {
  const Labelled knee = Draw(KneeRods(), Turned(0), 9);
  const auto bones = NamesByNumber(knee.labels, Region::kKnee);
  const std::vector<std::string> preset{"femur", "tibia", "fibula", "patella"};
  for (size_t b = 0; b < bones.size(); ++b) {
    EXPECT_EQ(bones[b].name, preset[b]);
    const bool right = knee.truth.at(int(b) + 1) == preset[b];
    EXPECT_EQ(bones[b].looks_like, right ? "" : knee.truth.at(int(b) + 1));
    EXPECT_EQ(bones[b].confidence >= kSureName, right);
  }
  EXPECT_NE(knee.truth, NamesIn(bones)) << "the draw was not shuffled";
}

TEST(LooksOtherwise, OnlyBonesThatHaveAnothersName) {
  const Labelled knee = Draw(KneeRods(), Turned(0), 9);
  BoneSet set;
  set.labels = knee.labels;
  for (const auto& [label, name] : knee.truth) set.bones.push_back({.label = label, .name = name});
  EXPECT_TRUE(LooksOtherwise(set, Region::kKnee).empty());
  const auto named = [&](const std::string& name) { return std::ranges::find(set.bones, name, &Bone::name); };
  std::swap(named("fibula")->label, named("patella")->label);
  EXPECT_THAT(LooksOtherwise(set, Region::kKnee),
              testing::UnorderedElementsAre("fibula looks like patella", "patella looks like fibula"));
  named("patella")->name = "Patella";
  EXPECT_THAT(LooksOtherwise(set, Region::kKnee),
              testing::UnorderedElementsAre("fibula looks like patella", "Patella looks like fibula"));
  named("fibula")->name = "sesamoid";
  EXPECT_THAT(LooksOtherwise(set, Region::kKnee), testing::ElementsAre("Patella looks like fibula"))
      << "a name of the user's own may mean anything";
  EXPECT_TRUE(LooksOtherwise(set, Region::kCustom).empty());
}

TEST(NamesByNumber, AnotherToolsNumbersSayNothing) {
  Labelled knee = Draw(KneeRods(), Turned(0), 9);
  for (uint16_t& label : knee.labels.values)
    label = uint16_t(label == 0 ? 0 : 20 * label - 17);  // 3, 23, ...
  const auto bones = NamesByNumber(knee.labels, Region::kKnee);
  ASSERT_EQ(bones.size(), 4u);
  for (size_t b = 0; b < bones.size(); ++b) {
    EXPECT_EQ(bones[b].name, knee.truth.at(int(b) + 1)) << "label " << bones[b].label;
    EXPECT_GE(bones[b].confidence, kSureName);
  }
}

TEST(NamesByNumber, NumbersAreThePresetsWhereTheRootIsThereOrFewAreBeyond) {
  EXPECT_TRUE(NumberedAsPreset({1, 2, 9}, Region::kKnee)) << "9 is something else, as cartilage";
  EXPECT_TRUE(NumberedAsPreset({2, 3}, Region::kKnee)) << "the root is missing";
  EXPECT_TRUE(NumberedAsPreset({2, 3, 255}, Region::kKnee)) << "and one label is something else";
  EXPECT_FALSE(NumberedAsPreset({3, 9, 17}, Region::kKnee));
}

}  // namespace
}  // namespace kvx
