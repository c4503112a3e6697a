// The cut's value against Boost's own maximum flow, and the cut itself against its value.
#include "pipeline/segmentation/cuts/lattice_cut.h"

#include <gtest/gtest.h>

#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // inside Boost
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <random>

namespace kvx {
namespace {

using boost::edge_capacity_t;
using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
using Graph = boost::adjacency_list<
    boost::vecS, boost::vecS, boost::directedS,
    boost::property<boost::vertex_index_t, long,
                    boost::property<boost::vertex_color_t, boost::default_color_type,
                                    boost::property<boost::vertex_distance_t, long,
                                                    boost::property<boost::vertex_predecessor_t,
                                                                    Traits::edge_descriptor>>>>,
    boost::property<edge_capacity_t, long,
                    boost::property<boost::edge_residual_capacity_t, long,
                                    boost::property<boost::edge_reverse_t, Traits::edge_descriptor>>>>;

struct Link {
  Eigen::Vector3i from, to;
  int direction;
  int32_t capacity;
};

struct Problem {
  Eigen::Vector3i size;
  std::vector<int32_t> terminal;  // source minus sink
  std::vector<Link> links;

  size_t Index(const Eigen::Vector3i& v) const {
    return size_t((v.z() * size.y() + v.y()) * size.x() + v.x());
  }
};

template <class Visit>
void ForEachVoxel(const Eigen::Vector3i& size, Visit&& visit) {
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) visit(Eigen::Vector3i(i, j, k));
    }
  }
}

Problem RandomProblem(const Eigen::Vector3i& size, const LatticeCut& lattice, unsigned seed) {
  std::mt19937 random(seed);
  Problem problem{size, {}, {}};
  ForEachVoxel(size, [&](const Eigen::Vector3i& v) {
    problem.terminal.push_back(int32_t(random() % 201) - 100);
    for (int d = 0; d < lattice.directions(); ++d) {
      const Eigen::Vector3i to = v + lattice.Step(d);
      if ((to.array() < 0).any() || (to.array() >= size.array()).any()) continue;
      problem.links.push_back(
          {v, to, d, random() % 4 == 0 ? 0 : int32_t(random() % 60)});  // some one-way, some missing
    }
  });
  return problem;
}

long BoostFlow(const Problem& problem) {
  const size_t voxels = problem.terminal.size();
  Graph graph(voxels + 2);
  const auto add = [&](size_t from, size_t to, long capacity) {
    const auto there = boost::add_edge(from, to, graph).first, back = boost::add_edge(to, from, graph).first;
    boost::put(boost::edge_capacity, graph, there, capacity);
    boost::put(boost::edge_capacity, graph, back, 0);
    boost::put(boost::edge_reverse, graph, there, back);
    boost::put(boost::edge_reverse, graph, back, there);
  };
  for (size_t v = 0; v < voxels; ++v) {
    if (problem.terminal[v] < 0) add(voxels, v, -problem.terminal[v]);
    if (problem.terminal[v] > 0) add(v, voxels + 1, problem.terminal[v]);
  }
  for (const Link& link : problem.links) add(problem.Index(link.from), problem.Index(link.to), link.capacity);
  return boost::boykov_kolmogorov_max_flow(graph, voxels, voxels + 1);
}

// What the cut costs, less what every cut costs: the source's part of the terminal links.
int64_t CostOf(const Problem& problem, const LatticeCut& lattice) {
  int64_t cost = 0;
  ForEachVoxel(problem.size, [&](const Eigen::Vector3i& v) {
    const int32_t terminal = problem.terminal[problem.Index(v)];
    cost += lattice.OnSourceSide(v) ? std::max(terminal, 0) : std::max(-terminal, 0);
  });
  for (const Link& link : problem.links) {
    if (lattice.OnSourceSide(link.from) && !lattice.OnSourceSide(link.to)) cost += link.capacity;
  }
  return cost;
}

class LatticeCutOf : public testing::TestWithParam<int> {};

TEST_P(LatticeCutOf, RandomVolumesHasTheValueThatBoostFinds) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    const Eigen::Vector3i size(2 + int(seed) % 5, 7 - int(seed) % 4, 1 + int(seed) % 6);
    LatticeCut lattice(size, GetParam());
    const Problem problem = RandomProblem(size, lattice, seed);
    ForEachVoxel(
        size, [&](const Eigen::Vector3i& v) { lattice.AddTerminal(v, problem.terminal[problem.Index(v)]); });
    for (const Link& link : problem.links) lattice.SetLink(link.from, link.direction, link.capacity);
    const int64_t flow = lattice.Solve();
    EXPECT_EQ(flow, BoostFlow(problem)) << "seed " << seed;
    EXPECT_EQ(flow, CostOf(problem, lattice)) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Neighbours, LatticeCutOf, testing::Values(6, 18, 26));

// Voxels that take no part are not there: the same problem as without their links and terminals.
TEST_P(LatticeCutOf, SomeVoxelsHasTheValueThatBoostFinds) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    const Eigen::Vector3i size(3 + int(seed) % 4, 6 - int(seed) % 3, 2 + int(seed) % 4);
    Problem problem = RandomProblem(size, LatticeCut(size, GetParam()), seed);
    std::mt19937 random(seed + 100);
    std::vector<uint8_t> taking_part(problem.terminal.size());
    for (uint8_t& takes : taking_part) takes = random() % 3 != 0;
    for (size_t v = 0; v < taking_part.size(); ++v) problem.terminal[v] *= taking_part[v];
    std::erase_if(problem.links, [&](const Link& link) {
      return !taking_part[problem.Index(link.from)] || !taking_part[problem.Index(link.to)];
    });
    LatticeCut lattice(size, GetParam(), taking_part);
    ForEachVoxel(size, [&](const Eigen::Vector3i& v) {
      if (taking_part[problem.Index(v)]) lattice.AddTerminal(v, problem.terminal[problem.Index(v)]);
    });
    for (const Link& link : problem.links) lattice.SetLink(link.from, link.direction, link.capacity);
    const int64_t flow = lattice.Solve();
    EXPECT_EQ(flow, BoostFlow(problem)) << "seed " << seed;
    EXPECT_EQ(flow, CostOf(problem, lattice)) << "seed " << seed;
  }
}

// Two layers: links of each, and one-way links between them.
TEST_P(LatticeCutOf, LayersHasTheValueThatBoostFinds) {
  constexpr int kNextLayer = -1;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const Eigen::Vector3i size(2 + int(seed) % 4, 5 - int(seed) % 3, 1 + int(seed) % 4);
    const Eigen::Vector3i both(size.x(), size.y(), 2 * size.z());
    LatticeCut lattice(size, GetParam(), {}, 2);
    Problem problem = RandomProblem(both, lattice, seed);
    std::erase_if(problem.links,
                  [&](const Link& link) { return link.from.z() / size.z() != link.to.z() / size.z(); });
    std::mt19937 random(seed + 200);
    ForEachVoxel(size, [&](const Eigen::Vector3i& v) {
      problem.links.push_back({v, v + Eigen::Vector3i(0, 0, size.z()), kNextLayer, int32_t(random() % 90)});
    });
    ForEachVoxel(
        both, [&](const Eigen::Vector3i& v) { lattice.AddTerminal(v, problem.terminal[problem.Index(v)]); });
    for (const Link& link : problem.links) {
      if (link.direction == kNextLayer)
        lattice.SetLinkToNextLayer(link.from, link.capacity);
      else
        lattice.SetLink(link.from, link.direction, link.capacity);
    }
    const int64_t flow = lattice.Solve();
    EXPECT_EQ(flow, BoostFlow(problem)) << "seed " << seed;
    EXPECT_EQ(flow, CostOf(problem, lattice)) << "seed " << seed;
  }
}

// Three voxels in a row; the weaker of the two links is cut.
TEST(LatticeCut, CutsTheWeakestLinkOfAChain) {
  LatticeCut lattice({3, 1, 1}, 6);
  int forward = -1;
  for (int d = 0; d < lattice.directions(); ++d) {
    if (lattice.Step(d) == Eigen::Vector3i(1, 0, 0)) forward = d;
  }
  lattice.AddTerminal({0, 0, 0}, -100);
  lattice.AddTerminal({2, 0, 0}, 100);
  lattice.SetLink({0, 0, 0}, forward, 7);
  lattice.SetLink({1, 0, 0}, forward, 5);
  EXPECT_EQ(lattice.Solve(), 5);
  EXPECT_TRUE(lattice.OnSourceSide({1, 0, 0}));
  EXPECT_FALSE(lattice.OnSourceSide({2, 0, 0}));
}

}  // namespace
}  // namespace kvx
