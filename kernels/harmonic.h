// Harmonic fields on a graph of voxels, on the device: multigrid cycles, eight fields side by side.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/device/backend.h"

namespace kvx {

constexpr int kFieldsPerSolve = 8;

// Nodes of one level; those of the first colour come first, and none has a neighbour of its own colour. Every
// node has six neighbour slots (-x +x -y +y -z +z), the node itself with conductance 0 where there is none.
// diagonal = sum of a node's conductances, to neighbours and to what is fixed.
struct HarmonicGraph {
  int first_colour_count = 0;
  std::vector<int32_t> neighbours;      // 6 per node
  std::vector<float> conductance;       // 6 per node
  std::vector<float> inverse_diagonal;  // 1 per node
  int size() const { return int(inverse_diagonal.size()); }
};

// Between a level and the next coarser one.
struct HarmonicTransfer {
  // 4 per node of the finer level: its coarse node, and along x, y and z the coarse node on the side where it
  // lies of that one's middle; the coarse node itself where there is none.
  std::vector<int32_t> around;
  std::vector<int32_t> children;  // 4 per coarse node: its finer nodes of the first colour; -1: none
};

struct HarmonicLevels {
  std::vector<HarmonicGraph> graphs;        // finest first; at least one
  std::vector<HarmonicTransfer> transfers;  // [n]: between graphs[n] and graphs[n + 1]
};

struct CycleOptions {
  float tolerance = 1e-4f;  // stop when values are right to about this
  int max_cycles = 1000;
};

// Of a W-cycle (Brandt 1977): how often a level asks the next coarser one; sweeps of the coarsest.
constexpr int kVisits = 2, kCoarsestSweeps = 10;
constexpr float kCoarsestOmega = 1.5f;

// W-cycles with a red-black Gauss-Seidel sweep before and after each correction.
class HarmonicSolver {
 public:
  explicit HarmonicSolver(Backend& backend);
  // Improves `fields` of the finest level (kFieldsPerSolve per node) in place and returns the cycles it took.
  // `anchors`: what holds them, each node's conductance to fixed ones times their values, laid out likewise.
  int operator()(const HarmonicLevels& levels, const std::vector<float>& anchors, const CycleOptions& options,
                 std::vector<float>& fields) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
