// The body as a graph of voxels with its coarser levels: what harmonic weights are solved on.
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

struct HarmonicBody {
  HarmonicLevels levels;
  std::vector<uint32_t> voxel;  // memory index of each node of the finest level
  std::vector<Anchor> anchors;  // of the finest level, to bone voxels beside its nodes
};

// Nodes are the free voxels. Conductance = 1 / spacing^2 between voxels that touch, twice that to a bone,
// none through what is outside. A coarse node is the free voxels of a block of two along each axis (fewer
// where slices are thick) as one, so an air gap stays a gap.
HarmonicBody HarmonicBodyOf(const RoleMap& roles);

// Weights of bones [first_bone, first_bone + kFieldsPerSolve) at the nodes of the finest level, right to
// about `tolerance`, as far as single precision goes.
std::vector<float> SolveHarmonic(const HarmonicSolver& solver, const HarmonicBody& body, int first_bone,
                                 double tolerance);

}  // namespace kvx
