// Greys of another sequence from a voxel's own grey and those beside it, against functions that are known.
#include "pipeline/registration/images/grey_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace kvx {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

// Darkest, own, brightest, as they may be.
std::vector<Eigen::Vector3f> RandomGreys(int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0, 200);
  std::vector<Eigen::Vector3f> out(size_t(count), Eigen::Vector3f::Zero());
  for (Eigen::Vector3f& greys : out) {
    for (int a = 0; a < 3; ++a) greys[a] = uniform(random);
    std::sort(greys.begin(), greys.end());
  }
  return out;
}

TEST(SurroundedGreys, AreTheExtremesOfAVoxelAndItsTwentySixNeighbours) {
  Grid grid;
  grid.size = {4, 4, 4};
  Volume volume(grid, 10);
  volume(1, 1, 1) = 3;
  volume(3, 3, 3) = 40;
  const std::vector<Eigen::Vector3f> greys = SurroundedGreys(volume);
  EXPECT_EQ(greys[grid.Index(0, 0, 0)], Eigen::Vector3f(3, 10, 10));
  EXPECT_EQ(greys[grid.Index(1, 1, 1)], Eigen::Vector3f(3, 3, 10));
  EXPECT_EQ(greys[grid.Index(2, 2, 2)], Eigen::Vector3f(3, 10, 40));
  EXPECT_EQ(greys[grid.Index(3, 0, 0)], Eigen::Vector3f(10, 10, 10));
}

TEST(GreyTable, FollowsASmoothFunctionOfAllThree) {
  const auto function = [](const Eigen::Vector3f& g) { return 50 + 0.3f * g[0] - 0.002f * g[1] * g[2]; };
  const std::vector<Eigen::Vector3f> greys = RandomGreys(20000);
  std::vector<float> shown;
  for (const Eigen::Vector3f& g : greys) shown.push_back(function(g));
  const GreyTable table(greys, shown);
  for (const Eigen::Vector3f& g : {Eigen::Vector3f(20, 60, 150), {80, 90, 110}, {40, 150, 180}})
    EXPECT_NEAR(table(g), function(g), 2);
}

// Muscle is as grey as a voxel that fat and air share, and much darker than fat; here air and fat are dark.
TEST(GreyTable, TellsAnEdgeFromATissueThatIsAsGrey) {
  std::vector<Eigen::Vector3f> greys;
  std::vector<float> shown;
  for (int n = 0; n < 1000; ++n) {
    const float noise = float(n % 11 - 5);
    greys.insert(greys.end(),
                 {{90, 100 + noise, 110}, {0, 100 + noise, 200}, {0, noise, 10}, {190, 200, 200}});
    shown.insert(shown.end(), {150, 20, 0, 40});
  }
  const GreyTable table(greys, shown);
  EXPECT_NEAR(table({90, 100, 110}), 150, 3);
  EXPECT_NEAR(table({0, 100, 200}), 20, 3);
}

// Of 20000 voxels 4 speak half for themselves in each of the five tables: n of them leave 4 / (n + 4) of what
// they say to the next finer one. They lie at a corner of all tables, and the others at two other corners.
TEST(GreyTable, WhatFewVoxelsSayCountsInPart) {
  for (const int count : {1, 4, 400}) {
    std::vector<Eigen::Vector3f> greys(size_t(count), {0, 100, 100});
    std::vector<float> shown(greys.size(), 5000);
    for (const float grey : {0.0f, 100.0f}) {
      greys.insert(greys.end(), size_t(20000 - count) / 2, Eigen::Vector3f::Constant(grey));
      shown.resize(greys.size(), 70);
    }
    greys.resize(20000, Eigen::Vector3f::Zero()), shown.resize(20000, 70);  // where the count is odd
    const GreyTable table(greys, shown);
    EXPECT_NEAR(table({0, 100, 100}), 5000 * (1 - std::pow(4.0 / (count + 4), 5)), 1) << count;
    EXPECT_NEAR(table({100, 100, 100}), 70, 0.1);
  }
}

TEST(GreyTable, PlacesThatTheScanDoesNotShowSayNothing) {
  std::vector<Eigen::Vector3f> greys = RandomGreys(5000);
  std::vector<float> shown(greys.size(), 70);
  for (size_t n = 0; n < shown.size(); n += 2) shown[n] = kNothing;
  EXPECT_NEAR(GreyTable(greys, shown)({20, 60, 150}), 70, 1);
  EXPECT_EQ(GreyTable(greys, std::vector<float>(greys.size(), kNothing))({20, 60, 150}), 0);
  EXPECT_EQ(GreyTable({}, {})({20, 60, 150}), 0);
}

}  // namespace
}  // namespace kvx
