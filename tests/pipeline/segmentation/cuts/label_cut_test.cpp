// With two labels an expansion is the cheapest of all states, and small ones can be tried one by one.
#include "pipeline/segmentation/cuts/label_cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace kvx {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
// Of all links across a face of cubic voxels one is straight, four are aslant.
const double kStraightArea = 1 / (1 + 4 / std::sqrt(2.0));

LabelMap Chain(int length) {
  Grid grid;
  grid.size = {length, 1, 1};
  return LabelMap(grid, 1);
}

struct Problem {
  std::vector<std::vector<float>> nats;  // by label - 1 and voxel
  Image<float> seam_root;

  double CostOf(const std::vector<uint16_t>& labels) const {
    double cost = 0;
    for (size_t v = 0; v < labels.size(); ++v) {
      cost += nats[labels[v] - 1u][v];
      if (v > 0 && labels[v] != labels[v - 1])
        cost += kStraightArea * seam_root.values[v] * seam_root.values[v - 1];
    }
    return cost;
  }
  LabelMap Solve(const LabelMap& first) const {
    return CheapestLabels(first, {[&](uint16_t label, size_t v) { return nats[label - 1u][v]; }, seam_root});
  }
};

Problem RandomProblem(int labels, int length, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> nats(0, 2), root(0.1f, 3);
  Problem problem{{}, Image<float>(Chain(length).grid)};
  for (float& r : problem.seam_root.values) r = root(random);
  for (int n = 0; n < labels; ++n) {
    problem.nats.emplace_back();
    for (int v = 0; v < length; ++v) problem.nats.back().push_back(nats(random));
  }
  return problem;
}

TEST(CheapestLabels, OfTwoAreCheapestOfAll) {
  constexpr int kLength = 9;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Problem problem = RandomProblem(2, kLength, seed);
    double least = kNever;
    for (int state = 0; state < 1 << kLength; ++state) {
      std::vector<uint16_t> labels;
      for (int v = 0; v < kLength; ++v) labels.push_back(uint16_t(1 + (state >> v & 1)));
      least = std::min(least, problem.CostOf(labels));
    }
    LabelMap first = Chain(kLength);
    first.values[seed % kLength] = 2;  // a label that nothing has is none to take
    EXPECT_NEAR(problem.CostOf(problem.Solve(first).values), least, 0.02) << "seed " << seed;
  }
}

TEST(CheapestLabels, OfThreeAreNoDearerThanTheFirstOrAnyMoveFromThere) {
  constexpr int kLength = 8;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Problem problem = RandomProblem(3, kLength, seed);
    LabelMap first = Chain(kLength);
    for (int v = 0; v < kLength; ++v) first.values[size_t(v)] = uint16_t(1 + v % 3);
    const LabelMap found = problem.Solve(first);
    const double cost = problem.CostOf(found.values);
    EXPECT_LE(cost, problem.CostOf(first.values));
    for (uint16_t label = 1; label <= 3; ++label) {
      for (int move = 0; move < 1 << kLength; ++move) {
        std::vector<uint16_t> labels = found.values;
        for (int v = 0; v < kLength; ++v) {
          if (move >> v & 1) labels[size_t(v)] = label;
        }
        EXPECT_GE(problem.CostOf(labels), cost - 0.02) << "seed " << seed;
      }
    }
  }
}

TEST(CheapestLabels, LeaveVoxelsWithoutALabelAndLabelsThatCannotBe) {
  Problem problem = RandomProblem(2, 5, 1);
  problem.nats = {{0, 0, kNever, 9, 9}, {kNever, 9, 0, 0, 0}};
  LabelMap first = Chain(5);
  first.values = {1, 1, 2, 0, 1};
  EXPECT_EQ(problem.Solve(first).values, (std::vector<uint16_t>{1, 1, 2, 0, 2}));
}

}  // namespace
}  // namespace kvx
