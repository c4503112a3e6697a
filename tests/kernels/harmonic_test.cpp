// Harmonic fields on a bar, where they are linear, and the kernel against its twin.
#include "kernels/harmonic.h"

#include <gtest/gtest.h>

#include "kernels/reference/harmonic.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr int kNodes = 9;

// Position 0..n-1 along the bar -> node: even positions (the first colour) come first.
int NodeAt(int position) { return position % 2 == 0 ? position / 2 : (kNodes + 1) / 2 + position / 2; }

struct Bar {
  HarmonicGraph graph;
  std::vector<float> anchors = std::vector<float>(kNodes * kFieldsPerSolve, 0.0f);
};

// Held at 1 beyond its left end by field 0, beyond its right end by field 3.
Bar MakeBar() {
  Bar bar;
  bar.graph.first_colour_count = (kNodes + 1) / 2;
  bar.graph.neighbours.resize(6 * kNodes);
  bar.graph.conductance.assign(6 * kNodes, 0.0f);
  bar.graph.inverse_diagonal.assign(kNodes, 0.5f);
  for (int p = 0; p < kNodes; ++p) {
    for (int d = 0; d < 6; ++d) {
      const int beside = p + (d == 1) - (d == 0);
      const bool joined = beside != p && beside >= 0 && beside < kNodes;
      bar.graph.neighbours[6 * NodeAt(p) + d] = NodeAt(joined ? beside : p);
      bar.graph.conductance[6 * NodeAt(p) + d] = joined ? 1.0f : 0.0f;
    }
  }
  bar.anchors[NodeAt(0) * kFieldsPerSolve + 0] = 1.0f;
  bar.anchors[NodeAt(kNodes - 1) * kFieldsPerSolve + 3] = 1.0f;
  return bar;
}

TEST(HarmonicSolver, ABarIsLinear) {
  const Bar bar = MakeBar();
  std::vector<float> fields(kNodes * kFieldsPerSolve, 0.0f);
  const int sweeps = HarmonicSolver(SharedBackend())(bar.graph, bar.anchors, {.tolerance = 1e-7f}, fields);
  EXPECT_LT(sweeps, 200);
  for (int p = 0; p < kNodes; ++p) {
    const double right = double(p + 1) / (kNodes + 1);
    EXPECT_NEAR(fields[NodeAt(p) * kFieldsPerSolve + 0], 1 - right, 1e-5);
    EXPECT_NEAR(fields[NodeAt(p) * kFieldsPerSolve + 3], right, 1e-5);
    EXPECT_EQ(fields[NodeAt(p) * kFieldsPerSolve + 5], 0.0f);
  }
}

TEST(HarmonicSolver, AgreesWithItsTwinSweepBySweep) {
  const Bar bar = MakeBar();
  std::vector<float> device(kNodes * kFieldsPerSolve, 0.25f), twin = device;
  const HarmonicSolver solve(SharedBackend());
  solve(bar.graph, bar.anchors, {.omega = 1.4f, .tolerance = 0, .max_sweeps = 5}, device);
  reference::HarmonicSweeps(bar.graph, bar.anchors, 1.4f, 5, twin);
  for (size_t n = 0; n < twin.size(); ++n) ASSERT_NEAR(device[n], twin[n], 1e-5) << "value " << n;
}

}  // namespace
}  // namespace kvx
