// Building the graphs. A coarse level only corrects the finer ones, so it need not be right to the last edge.
#include "pipeline/skinning/harmonic_levels.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/neighbours.h"

namespace kvx {
namespace {

constexpr int32_t kNoNode = -1;
constexpr float kToBone = 2;    // its surface is half as far off as its voxel's centre (docs/conventions.md)
constexpr int kFewNodes = 256;  // a level this small needs no coarser one

struct Level {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<uint32_t> cell;    // memory index of each node in a box of `size`
  std::vector<int32_t> node_at;  // of the box' cells
  HarmonicGraph graph;
  std::vector<float> anchored;  // conductance of each node to bones
  Eigen::Array3d along;         // conductance of an edge between full nodes, per axis
};

Eigen::Vector3i IjkOf(const Eigen::Vector3i& size, uint32_t cell) {
  return {int(cell % size.x()), int(cell / size.x() % size.y()), int(cell / (size.x() * size.y()))};
}
uint32_t CellOf(const Eigen::Vector3i& size, const Eigen::Vector3i& p) {
  return uint32_t((p.z() * size.y() + p.y()) * size.x() + p.x());
}

// Numbers the marked cells, those of even parity first.
void NumberNodes(const std::vector<uint8_t>& marked, Level& level) {
  level.node_at.assign(marked.size(), kNoNode);
  for (int colour = 0; colour < 2; ++colour) {
    const size_t rows = size_t(level.size.y()) * size_t(level.size.z());
    for (size_t row = 0; row < rows; ++row) {
      const size_t j = row % size_t(level.size.y()), k = row / size_t(level.size.y());
      const size_t first = row * size_t(level.size.x()), end = first + size_t(level.size.x());
      for (size_t c = first + (size_t(colour) + j + k) % 2; c < end; c += 2) {
        if (!marked[c]) continue;
        level.node_at[c] = int32_t(level.cell.size());
        level.cell.push_back(uint32_t(c));
      }
    }
    if (colour == 0) level.graph.first_colour_count = int(level.cell.size());
  }
  level.graph.neighbours.resize(6 * level.cell.size());
  for (size_t e = 0; e < level.graph.neighbours.size(); ++e) level.graph.neighbours[e] = int32_t(e / 6);
  level.graph.conductance.assign(6 * level.cell.size(), 0.0f);
  level.anchored.assign(level.cell.size(), 0.0f);
}

void FinishDiagonal(Level& level) {
  level.graph.inverse_diagonal.resize(level.cell.size());
  ParallelEach(level.cell.size(), [&](size_t n) {
    double diagonal = level.anchored[n];
    for (size_t e = 6 * n; e < 6 * n + 6; ++e) diagonal += level.graph.conductance[e];
    level.graph.inverse_diagonal[n] = diagonal > 0 ? float(1.0 / diagonal) : 0.0f;
  });
}

Level FinestLevel(const RoleMap& roles, std::vector<Anchor>& anchors) {
  Level level;
  level.size = roles.grid.size;
  std::vector<uint8_t> marked(roles.values.size());
  ParallelEach(marked.size(), [&](size_t v) { marked[v] = roles.values[v] == kFree; });
  NumberNodes(marked, level);
  level.along = (roles.grid.spacing_mm.minCoeff() / roles.grid.spacing_mm.array()).square();
  for (size_t n = 0; n < level.cell.size(); ++n) {
    const Eigen::Vector3i p = IjkOf(level.size, level.cell[n]);
    for (int d = 0; d < 6; ++d) {
      const Eigen::Vector3i q = p + StepToSide(d);
      if (!roles.grid.Contains(q)) continue;
      const uint32_t beside = CellOf(level.size, q);
      const float conductance = float(level.along[d / 2]);
      if (roles.values[beside] >= 0) {
        anchors.push_back({int32_t(n), roles.values[beside], kToBone * conductance});
        level.anchored[n] += kToBone * conductance;
      } else if (roles.values[beside] == kFree) {
        level.graph.neighbours[6 * n + d] = level.node_at[beside];
        level.graph.conductance[6 * n + d] = conductance;
      }
    }
  }
  FinishDiagonal(level);
  return level;
}

// Voxels in a block, per axis: a sweep evens out errors along the axes of firm edges only, so where slices
// are thick no two of them are one block until blocks are as wide.
Eigen::Array3i BlockOf(const Level& fine) {
  constexpr double kFirm = 0.3;  // of the firmest
  return (fine.along >= kFirm * fine.along.maxCoeff()).select(Eigen::Array3i(2, 2, 2), 1);
}

// Blocks are up to twice as far from each other as their nodes were, but a bone may be as near to them as
// before: held less firmly there, as the middles of blocks would have it, levels correct too much.
Level Coarser(const Level& fine, const Eigen::Array3i& block) {
  Level coarse;
  coarse.size = ((fine.size.array() + block - 1) / block).matrix();
  coarse.along = fine.along * double(block.prod()) / block.cast<double>().square();
  std::vector<uint32_t> cell(fine.cell.size());
  ParallelEach(cell.size(), [&](size_t n) {
    cell[n] = CellOf(coarse.size, (IjkOf(fine.size, fine.cell[n]).array() / block).matrix());
  });
  std::vector<uint8_t> marked(size_t(coarse.size.prod()), 0);
  for (const uint32_t c : cell) marked[c] = 1;
  NumberNodes(marked, coarse);
  for (size_t n = 0; n < cell.size(); ++n) {
    const int32_t here = coarse.node_at[cell[n]];
    coarse.anchored[here] += fine.anchored[n];
    for (size_t d = 0; d < 6; ++d) {
      const float conductance = fine.graph.conductance[6 * n + d];
      const int32_t there = coarse.node_at[cell[fine.graph.neighbours[6 * n + d]]];
      if (conductance == 0 || here == there) continue;
      coarse.graph.neighbours[6 * size_t(here) + d] = there;
      coarse.graph.conductance[6 * size_t(here) + d] += conductance / float(block[d / 2]);
    }
  }
  FinishDiagonal(coarse);
  return coarse;
}

HarmonicTransfer TransferOf(const Level& fine, const Level& coarse, const Eigen::Array3i& block) {
  HarmonicTransfer transfer;
  transfer.around.resize(4 * fine.cell.size());
  transfer.children.assign(4 * coarse.cell.size(), kNoNode);
  ParallelEach(fine.cell.size(), [&](size_t n) {
    const Eigen::Vector3i p = IjkOf(fine.size, fine.cell[n]);
    const int32_t own = coarse.node_at[CellOf(coarse.size, (p.array() / block).matrix())];
    transfer.around[4 * n] = own;
    for (int axis = 0; axis < 3; ++axis) {
      const size_t side = 6 * size_t(own) + 2 * size_t(axis) + size_t(p[axis] % 2);
      transfer.around[4 * n + 1 + axis] = block[axis] == 2 ? coarse.graph.neighbours[side] : own;
    }
  });
  for (int32_t n = 0; n < fine.graph.first_colour_count; ++n) {
    const auto first = transfer.children.begin() + 4 * ptrdiff_t(transfer.around[4 * size_t(n)]);
    *std::find(first, first + 4, kNoNode) = n;
  }
  return transfer;
}

std::vector<float> DenseAnchors(const HarmonicBody& body, int first_bone) {
  std::vector<float> dense(body.voxel.size() * kFieldsPerSolve, 0.0f);
  for (const Anchor& a : body.anchors) {
    const int field = a.bone - first_bone;
    if (field >= 0 && field < kFieldsPerSolve)
      dense[size_t(a.node) * kFieldsPerSolve + field] += a.conductance;
  }
  return dense;
}

}  // namespace

HarmonicBody HarmonicBodyOf(const RoleMap& roles) {
  HarmonicBody body;
  Level level = FinestLevel(roles, body.anchors);
  body.voxel = level.cell;
  while (int(level.cell.size()) > kFewNodes) {
    const Eigen::Array3i block = BlockOf(level);
    Level coarser = Coarser(level, block);
    body.levels.transfers.push_back(TransferOf(level, coarser, block));
    body.levels.graphs.push_back(std::move(level.graph));
    level = std::move(coarser);
  }
  body.levels.graphs.push_back(std::move(level.graph));
  return body;
}

std::vector<float> SolveHarmonic(const HarmonicSolver& solver, const HarmonicBody& body, int first_bone,
                                 double tolerance) {
  std::vector<float> fields(body.voxel.size() * kFieldsPerSolve, 0.0f);
  solver(body.levels, DenseAnchors(body, first_bone), {.tolerance = float(tolerance)}, fields);
  return fields;
}

}  // namespace kvx
