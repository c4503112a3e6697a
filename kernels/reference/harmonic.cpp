// Plain loops, double precision within a node.
#include "kernels/reference/harmonic.h"

namespace kvx::reference {

void HarmonicSweeps(const HarmonicGraph& graph, const std::vector<float>& anchors, float omega, int sweeps,
                    std::vector<float>& fields) {
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (size_t node = 0; node < size_t(graph.size()); ++node) {  // the first colour comes first
      for (size_t f = 0; f < kFieldsPerSolve; ++f) {
        double sum = anchors[node * kFieldsPerSolve + f];
        for (size_t d = 6 * node; d < 6 * node + 6; ++d) {
          sum += double(graph.conductance[d]) * fields[size_t(graph.neighbours[d]) * kFieldsPerSolve + f];
        }
        float& value = fields[node * kFieldsPerSolve + f];
        value = float(value + omega * (sum * graph.inverse_diagonal[node] - value));
      }
    }
  }
}

}  // namespace kvx::reference
