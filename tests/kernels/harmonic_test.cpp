// Harmonic fields on a bar, where they are linear, and the kernels against their twin.
#include "kernels/harmonic.h"

#include <gtest/gtest.h>

#include "kernels/reference/harmonic.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Position 0..n-1 along the bar -> node: even positions (the first colour) come first.
int NodeAt(int position, int nodes) {
  return position % 2 == 0 ? position / 2 : (nodes + 1) / 2 + position / 2;
}

// `conductance`: of an edge. Held with 1 at both ends.
HarmonicGraph BarGraph(int nodes, float conductance) {
  HarmonicGraph graph;
  graph.first_colour_count = (nodes + 1) / 2;
  graph.neighbours.resize(6 * size_t(nodes));
  graph.conductance.assign(6 * size_t(nodes), 0.0f);
  graph.inverse_diagonal.resize(size_t(nodes));
  for (int p = 0; p < nodes; ++p) {
    const size_t node = size_t(NodeAt(p, nodes));
    float diagonal = (p == 0 ? 1.0f : 0.0f) + (p + 1 == nodes ? 1.0f : 0.0f);
    for (int d = 0; d < 6; ++d) {
      const int beside = p + (d == 1) - (d == 0);
      const bool joined = beside != p && beside >= 0 && beside < nodes;
      graph.neighbours[6 * node + size_t(d)] = NodeAt(joined ? beside : p, nodes);
      graph.conductance[6 * node + size_t(d)] = joined ? conductance : 0.0f;
      if (joined) diagonal += conductance;
    }
    graph.inverse_diagonal[node] = 1 / diagonal;
  }
  return graph;
}

HarmonicTransfer BarTransfer(int nodes) {
  const int blocks = (nodes + 1) / 2;
  HarmonicTransfer transfer{std::vector<int32_t>(4 * size_t(nodes)),
                            std::vector<int32_t>(4 * size_t(blocks), -1)};
  for (int p = 0; p < nodes; ++p) {
    const size_t node = size_t(NodeAt(p, nodes));
    const int block = p / 2, beside = std::clamp(block + (p % 2 ? 1 : -1), 0, blocks - 1);
    for (size_t a = 0; a < 4; ++a) transfer.around[4 * node + a] = NodeAt(a == 1 ? beside : block, blocks);
    if (p % 2 == 0) transfer.children[4 * size_t(NodeAt(block, blocks))] = int32_t(node);
  }
  return transfer;
}

HarmonicLevels BarLevels(int nodes, int count) {
  HarmonicLevels levels;
  float conductance = 1;
  for (int l = 0; l < count; ++l, nodes = (nodes + 1) / 2, conductance /= 2) {
    levels.graphs.push_back(BarGraph(nodes, conductance));
    if (l + 1 < count) levels.transfers.push_back(BarTransfer(nodes));
  }
  return levels;
}

// Held at 1 beyond its left end by field 0, beyond its right end by field 3.
std::vector<float> BarAnchors(int nodes) {
  std::vector<float> anchors(size_t(nodes) * kFieldsPerSolve, 0.0f);
  anchors[size_t(NodeAt(0, nodes)) * kFieldsPerSolve + 0] = 1.0f;
  anchors[size_t(NodeAt(nodes - 1, nodes)) * kFieldsPerSolve + 3] = 1.0f;
  return anchors;
}

// Returns the cycles it took.
int ExpectLinear(int nodes, int level_count) {
  std::vector<float> fields(size_t(nodes) * kFieldsPerSolve, 0.0f);
  const int cycles = HarmonicSolver(SharedBackend())(BarLevels(nodes, level_count), BarAnchors(nodes),
                                                     {.tolerance = 1e-6f}, fields);
  for (int p = 0; p < nodes; ++p) {
    const size_t at = size_t(NodeAt(p, nodes)) * kFieldsPerSolve;
    const double right = double(p + 1) / (nodes + 1);
    EXPECT_NEAR(fields[at + 0], 1 - right, 1e-5);
    EXPECT_NEAR(fields[at + 3], right, 1e-5);
    EXPECT_EQ(fields[at + 5], 0.0f);
  }
  return cycles;
}

TEST(HarmonicSolver, ABarOfOneLevelIsLinear) { ExpectLinear(9, 1); }

TEST(HarmonicSolver, ALongBarIsLinearAfterAFewCycles) { EXPECT_LT(ExpectLinear(101, 5), 15); }

// Ten sweeps a cycle do little for it: cycles change less and less long before they are done.
TEST(HarmonicSolver, ALongBarOfOneLevelIsLinearAfterManyCycles) { EXPECT_GT(ExpectLinear(60, 1), 40); }

TEST(HarmonicSolver, AgreesWithItsTwinCycleByCycle) {
  constexpr int kNodes = 37;
  const HarmonicLevels levels = BarLevels(kNodes, 3);
  const std::vector<float> anchors = BarAnchors(kNodes);
  std::vector<float> device(size_t(kNodes) * kFieldsPerSolve);
  for (size_t n = 0; n < device.size(); ++n) device[n] = 0.1f * float(n % 7);
  std::vector<float> twin = device;
  const HarmonicSolver solve(SharedBackend());
  for (int cycle = 0; cycle < 3; ++cycle) {
    EXPECT_EQ(solve(levels, anchors, {.tolerance = 0, .max_cycles = 1}, device), 1);
    reference::HarmonicCycle(levels, anchors, twin);
    for (size_t n = 0; n < twin.size(); ++n)
      ASSERT_NEAR(device[n], twin[n], 1e-5) << "value " << n << " of cycle " << cycle;
  }
}

}  // namespace
}  // namespace kvx
