// Harmonic fields on a graph of voxels, on the device: red-black over-relaxation, eight fields side by side.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/backend.h"

namespace kvx {

constexpr int kFieldsPerSolve = 8;

// Nodes of one level; those of the first colour come first. Every node has six neighbour slots (-x +x -y +y
// -z +z), the node itself with conductance 0 where there is none. diagonal = sum of a node's conductances and
// anchors.
struct HarmonicGraph {
  int first_colour_count = 0;
  std::vector<int32_t> neighbours;      // 6 per node
  std::vector<float> conductance;       // 6 per node
  std::vector<float> inverse_diagonal;  // 1 per node
  int size() const { return int(inverse_diagonal.size()); }
};

struct SweepOptions {
  float omega = 1.5f;       // over-relaxation, 1..2
  float tolerance = 1e-4f;  // stop when no value moves further in one sweep
  int max_sweeps = 2000;
};

// What holds the fields: `anchors` is the conductance of each node to fixed ones, per field (kFieldsPerSolve
// per node).
class HarmonicSolver {
 public:
  explicit HarmonicSolver(Backend& backend);
  // Relaxes `fields` (kFieldsPerSolve per node) in place and returns the sweeps it took.
  int operator()(const HarmonicGraph& graph, const std::vector<float>& anchors, const SweepOptions& options,
                 std::vector<float>& fields) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
