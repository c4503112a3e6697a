// Rows of a few voxels, of which every state can be counted out.
#include "pipeline/segmentation/cuts/binary_cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace kvx {
namespace {

constexpr int kVoxels = 6;

Grid Row() {
  Grid grid;
  grid.size = {kVoxels, 1, 1};
  return grid;
}

struct Problem {
  Volume relative{Row()};
  std::vector<CutLayer> layers;
};

// Two regions, the inner one with edges where it gets darker outwards, the outer one where it gets brighter.
Problem RandomProblem(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> nats(-3, 3), intensity(0, 1);
  Problem problem;
  for (float& r : problem.relative.values) r = intensity(random);
  for (const int falls : {1, -1}) {
    CutLayer layer{Image<float>(Row()),
                   Image<Side>(Row(), Side::kFree),
                   {.strength = 2, .contrast = 0.3, .falls_outwards = falls, .neighbours = 6}};
    for (float& cost : layer.inside_cost.values) cost = nats(random);
    problem.layers.push_back(std::move(layer));
  }
  return problem;
}

// Of voxels in this many regions; infinite where a side says otherwise.
double CostOf(const Problem& problem, const std::array<int, kVoxels>& regions) {
  double cost = 0;
  for (int l = 0; l < 2; ++l) {
    const CutLayer& layer = problem.layers[size_t(l)];
    const auto inside = [&](int v) { return regions[size_t(v)] >= 2 - l; };
    for (int v = 0; v < kVoxels; ++v) {
      const Side side = layer.sides.values[size_t(v)];
      if (side != Side::kFree && inside(v) != (side == Side::kInside))
        return std::numeric_limits<double>::infinity();
      cost += inside(v) && side == Side::kFree ? layer.inside_cost.values[size_t(v)] : 0;
      if (v == 0 || inside(v) == inside(v - 1)) continue;
      const int in = inside(v) ? v : v - 1, out = inside(v) ? v - 1 : v;
      const double edge = problem.relative.values[size_t(in)] - problem.relative.values[size_t(out)];
      const double z = std::max(0.0, edge * layer.links.falls_outwards) / layer.links.contrast;
      cost += layer.links.strength * std::exp(-0.5 * z * z);
    }
  }
  return cost;
}

double LeastCost(const Problem& problem) {
  double least = std::numeric_limits<double>::infinity();
  for (int state = 0; state < std::pow(3, kVoxels); ++state) {
    std::array<int, kVoxels> regions;
    for (int v = 0, rest = state; v < kVoxels; ++v, rest /= 3) regions[size_t(v)] = rest % 3;
    least = std::min(least, CostOf(problem, regions));
  }
  return least;
}

std::array<int, kVoxels> RegionsOf(const std::vector<Mask>& inside) {
  std::array<int, kVoxels> regions;
  for (size_t v = 0; v < kVoxels; ++v) {
    EXPECT_LE(inside[0].values[v], inside[1].values[v]);
    regions[v] = inside[0].values[v] + inside[1].values[v];
  }
  return regions;
}

TEST(NestedCut, IsTheCheapestOfAllNestedStates) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Problem problem = RandomProblem(seed);
    const double cost = CostOf(problem, RegionsOf(NestedCut(problem.layers, problem.relative)));
    EXPECT_NEAR(cost, LeastCost(problem), 0.02) << "seed " << seed;
  }
}

TEST(NestedCut, KeepsSidesOfEitherRegion) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Problem problem = RandomProblem(seed);
    problem.layers[0].sides.values[1] = Side::kInside;
    problem.layers[1].sides.values[2] = Side::kInside;
    problem.layers[1].sides.values[5] = Side::kOutside;
    const double cost = CostOf(problem, RegionsOf(NestedCut(problem.layers, problem.relative)));
    EXPECT_NEAR(cost, LeastCost(problem), 0.02) << "seed " << seed;
  }
}

TEST(MinimumCut, IsWhatTheRegionWouldBeAlone) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Problem problem = RandomProblem(seed);
    const Mask alone = MinimumCut(problem.layers[1], problem.relative);
    for (float& cost : problem.layers[0].inside_cost.values) cost = 50;  // the inner one is empty
    EXPECT_EQ(NestedCut(problem.layers, problem.relative)[1].values, alone.values) << "seed " << seed;
  }
}

}  // namespace
}  // namespace kvx
