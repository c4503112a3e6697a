// Where mutual information would have a scan's greys, and how firmly.
#include "pipeline/registration/blocks/information_targets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kvx {
namespace {

constexpr double kNoise = 0.5;

// What a grey of the template, from -1 to 1, looks like in a scan that shows some of them alike.
double AsInScan(double grey) { return 3 * std::abs(grey); }

struct World {
  BlockLevel level;
  std::vector<float> seen;
};

World MakeWorld() {
  World world;
  BlockLevel& level = world.level;
  level.grid.size = {60, 60, 60};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> grey(-1, 1);
  std::normal_distribution<double> noise(0, kNoise);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    level.own_greys.push_back(float(grey(random)));
    level.intensity.push_back(float(AsInScan(double(level.own_greys.back()))));
    world.seen.push_back(float(double(level.intensity.back()) + noise(random)));
  }
  level.weight.assign(level.grid.VoxelCount(), 1);
  return world;
}

// Of greys that the scan shows alike throughout, so that its own distribution is even.
bool IsInTheMiddle(double grey) { return std::abs(grey) > 0.35 && std::abs(grey) < 0.65; }

// Their histogram is as wide as the noise and the bins' windows, so the way to the target is right, too.
TEST(InformationTargets, LeadToWhatTheScanShowsOfAGreyAsFirmlyAsNoiseLets) {
  const World world = MakeWorld();
  const GreyTargets targets = InformationTargets(world.level).Of(world.seen);
  double off = 0, seen_off = 0, weights = 0, count = 0;
  for (size_t v = 0; v < world.seen.size(); ++v) {
    if (!IsInTheMiddle(double(world.level.own_greys[v]))) continue;
    off += std::abs(double(targets.greys[v] - world.level.intensity[v]));
    seen_off += std::abs(double(world.seen[v] - world.level.intensity[v]));
    weights += double(targets.weights[v]), count += 1;
  }
  EXPECT_LT(off, 0.1 * seen_off);
  EXPECT_NEAR(weights / count, 1 / (2 * kNoise * kNoise), 0.3 / (2 * kNoise * kNoise));
}

TEST(InformationTargets, LeaveVoxelsThatDoNotCountOrWereNotSeenAsTheyAre) {
  World world = MakeWorld();
  world.level.weight[7] = 0;
  world.seen[9] = kUnseen;
  const GreyTargets targets = InformationTargets(world.level).Of(world.seen);
  for (const size_t v : {7, 9}) {
    EXPECT_EQ(targets.greys[v], world.level.intensity[v]);
    EXPECT_EQ(targets.weights[v], world.level.weight[v]);
  }
}

// A scan that shows nothing of the template has nothing to say.
TEST(InformationTargets, HardlyCountWhereNothingIsShared) {
  World world = MakeWorld();
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 3);
  for (float& grey : world.seen) grey = float(noise(random));
  double weights = 0;
  for (const float weight : InformationTargets(world.level).Of(world.seen).weights) weights += double(weight);
  EXPECT_LT(weights / double(world.seen.size()), 0.1);
}

TEST(InformationTargets, AreForTheFinestLevelOfAnotherContrastAlone) {
  World world = MakeWorld();
  EXPECT_TRUE(InformationTargets(world.level).Apply());
  world.level.template_voxels = 2;
  EXPECT_FALSE(InformationTargets(world.level).Apply());
  world.level.template_voxels = 1;
  world.level.own_greys.clear();
  EXPECT_FALSE(InformationTargets(world.level).Apply());
}

}  // namespace
}  // namespace kvx
