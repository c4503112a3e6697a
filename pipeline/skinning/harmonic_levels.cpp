// Building the graphs, and the cascade from coarse to fine.
#include "pipeline/skinning/harmonic_levels.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr int32_t kNoNode = -1;
constexpr int kFewNodes = 256;  // a level this small needs no coarser one

Eigen::Vector3i IjkOf(const Eigen::Vector3i& size, uint32_t cell) {
  return {int(cell % size.x()), int(cell / size.x() % size.y()), int(cell / (size.x() * size.y()))};
}
uint32_t CellOf(const Eigen::Vector3i& size, const Eigen::Vector3i& p) {
  return uint32_t((p.z() * size.y() + p.y()) * size.x() + p.x());
}

// Numbers the marked cells, those of even parity first.
std::vector<int32_t> NumberNodes(const std::vector<uint8_t>& marked, HarmonicLevel& level) {
  std::vector<int32_t> node_at(marked.size(), kNoNode);
  for (int colour = 0; colour < 2; ++colour) {
    const size_t rows = size_t(level.size.y()) * size_t(level.size.z());
    for (size_t row = 0; row < rows; ++row) {
      const size_t j = row % size_t(level.size.y()), k = row / size_t(level.size.y());
      const size_t first = row * size_t(level.size.x()), end = first + size_t(level.size.x());
      for (size_t c = first + (size_t(colour) + j + k) % 2; c < end; c += 2) {
        if (!marked[c]) continue;
        node_at[c] = int32_t(level.cell.size());
        level.cell.push_back(uint32_t(c));
      }
    }
    if (colour == 0) level.graph.first_colour_count = int(level.cell.size());
  }
  level.graph.neighbours.resize(6 * level.cell.size());
  level.graph.conductance.assign(6 * level.cell.size(), 0.0f);
  for (size_t e = 0; e < level.graph.neighbours.size(); ++e) level.graph.neighbours[e] = int32_t(e / 6);
  return node_at;
}

void FinishDiagonal(HarmonicLevel& level) {
  std::vector<double> diagonal(level.cell.size(), 0.0);
  for (size_t e = 0; e < level.graph.conductance.size(); ++e) diagonal[e / 6] += level.graph.conductance[e];
  for (const Anchor& anchor : level.anchors) diagonal[anchor.node] += anchor.conductance;
  level.graph.inverse_diagonal.clear();
  for (const double d : diagonal) level.graph.inverse_diagonal.push_back(d > 0 ? float(1.0 / d) : 0.0f);
}

HarmonicLevel FinestLevel(const RoleMap& roles) {
  HarmonicLevel level;
  level.size = roles.grid.size;
  std::vector<uint8_t> marked(roles.values.size());
  for (size_t v = 0; v < marked.size(); ++v) marked[v] = roles.values[v] == kFree;
  const std::vector<int32_t> node_at = NumberNodes(marked, level);
  const Eigen::Vector3d along =  // of an edge, per axis
      (roles.grid.spacing_mm.minCoeff() / roles.grid.spacing_mm.array()).square();
  for (size_t n = 0; n < level.cell.size(); ++n) {
    const Eigen::Vector3i p = IjkOf(level.size, level.cell[n]);
    for (int d = 0; d < 6; ++d) {
      Eigen::Vector3i q = p;
      q[d / 2] += d % 2 ? 1 : -1;
      if (!roles.grid.Contains(q)) continue;
      const uint32_t beside = CellOf(level.size, q);
      const float conductance = float(along[d / 2]);
      if (roles.values[beside] >= 0) level.anchors.push_back({int32_t(n), roles.values[beside], conductance});
      if (roles.values[beside] != kFree) continue;
      level.graph.neighbours[6 * n + d] = node_at[beside];
      level.graph.conductance[6 * n + d] = conductance;
    }
  }
  FinishDiagonal(level);
  return level;
}

HarmonicLevel Coarser(HarmonicLevel& fine) {
  HarmonicLevel coarse;
  coarse.size = ((fine.size.array() + 1) / 2).matrix();
  const auto parent_cell = [&](uint32_t cell) {
    return CellOf(coarse.size, (IjkOf(fine.size, cell).array() / 2).matrix());
  };
  std::vector<uint8_t> marked(size_t(coarse.size.prod()), 0);
  for (const uint32_t cell : fine.cell) marked[parent_cell(cell)] = 1;
  const std::vector<int32_t> node_at = NumberNodes(marked, coarse);
  for (const uint32_t cell : fine.cell) fine.parent.push_back(node_at[parent_cell(cell)]);
  for (size_t e = 0; e < fine.graph.neighbours.size(); ++e) {
    const int32_t here = fine.parent[e / 6], there = fine.parent[fine.graph.neighbours[e]];
    if (here == there) continue;
    coarse.graph.neighbours[6 * size_t(here) + e % 6] = there;
    coarse.graph.conductance[6 * size_t(here) + e % 6] += fine.graph.conductance[e];
  }
  for (const Anchor& a : fine.anchors) coarse.anchors.push_back({fine.parent[a.node], a.bone, a.conductance});
  FinishDiagonal(coarse);
  return coarse;
}

// The most steps that any node is away from a bone.
int DepthOf(const HarmonicLevel& level) {
  std::vector<int> depth(level.cell.size(), -1);
  std::vector<int32_t> front;
  for (const Anchor& anchor : level.anchors) {
    if (depth[anchor.node] < 0) front.push_back(anchor.node);
    depth[anchor.node] = 0;
  }
  int deepest = 0;
  for (size_t next = 0; next < front.size(); ++next) {
    deepest = depth[front[next]];
    for (size_t e = 6 * size_t(front[next]); e < 6 * size_t(front[next]) + 6; ++e) {
      const int32_t beside = level.graph.neighbours[e];
      if (level.graph.conductance[e] == 0.0f || depth[beside] >= 0) continue;
      depth[beside] = deepest + 1;
      front.push_back(beside);
    }
  }
  return deepest + 1;
}

// Young's best factor for a rod of `depth` voxels, held at one end and free at the other.
float OverRelaxation(int depth) { return float(2.0 / (1.0 + std::sin(0.5 * kPi / (depth + 1)))); }

std::vector<float> DenseAnchors(const HarmonicLevel& level, int first_bone) {
  std::vector<float> dense(level.cell.size() * kFieldsPerSolve, 0.0f);
  for (const Anchor& a : level.anchors) {
    const int field = a.bone - first_bone;
    if (field >= 0 && field < kFieldsPerSolve)
      dense[size_t(a.node) * kFieldsPerSolve + field] += a.conductance;
  }
  return dense;
}

std::vector<float> FromCoarser(const HarmonicLevel& fine, const std::vector<float>& coarse) {
  std::vector<float> fields;
  fields.reserve(fine.parent.size() * kFieldsPerSolve);
  for (const int32_t parent : fine.parent) {
    const auto from = coarse.begin() + size_t(parent) * kFieldsPerSolve;
    fields.insert(fields.end(), from, from + kFieldsPerSolve);
  }
  return fields;
}

}  // namespace

std::vector<HarmonicLevel> BuildHarmonicLevels(const RoleMap& roles) {
  std::vector<HarmonicLevel> levels{FinestLevel(roles)};
  while (int(levels.back().cell.size()) > kFewNodes) levels.push_back(Coarser(levels.back()));
  return levels;
}

std::vector<float> SolveHarmonic(const HarmonicSolver& solver, const std::vector<HarmonicLevel>& levels,
                                 int first_bone, double tolerance) {
  std::vector<float> fields(levels.back().cell.size() * kFieldsPerSolve, 0.0f);
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    if (level != levels.rbegin()) fields = FromCoarser(*level, fields);
    const SweepOptions options{.omega = OverRelaxation(DepthOf(*level)), .tolerance = float(tolerance)};
    solver(level->graph, DenseAnchors(*level, first_bone), options, fields);
  }
  return fields;
}

}  // namespace kvx
