// The body as a graph of voxels and its coarser levels: harmonic weights solved from coarse to fine.
#pragma once
#include "core/image.h"
#include "kernels/harmonic.h"

namespace kvx {

// What a voxel is to the weights: a bone's number, or one of these.
constexpr int16_t kOutside = -2, kFree = -1;
using RoleMap = Image<int16_t>;

struct Anchor {
  int32_t node = 0;
  int16_t bone = 0;
  float conductance = 0;
};

struct HarmonicLevel {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<uint32_t> cell;   // memory index of each node in a box of `size`
  HarmonicGraph graph;          // of the free voxels
  std::vector<Anchor> anchors;  // to bone voxels beside them
  std::vector<int32_t> parent;  // node of the next coarser level; empty at the coarsest
};

// Finest level first. Conductance = 1 / spacing^2 between voxels that touch, none through what is outside. A
// coarse node is the free voxels of a 2x2x2 block as one; its conductances are sums, so an air gap stays a
// gap.
std::vector<HarmonicLevel> BuildHarmonicLevels(const RoleMap& roles);

// Weights of bones [first_bone, first_bone + kFieldsPerSolve) at the nodes of the finest level.
std::vector<float> SolveHarmonic(const HarmonicSolver& solver, const std::vector<HarmonicLevel>& levels,
                                 int first_bone, double tolerance);

}  // namespace kvx
