// Plain loops, double precision within a node.
#include "kernels/reference/harmonic.h"

namespace kvx::reference {
namespace {

constexpr size_t kFields = kFieldsPerSolve;

double Pull(const HarmonicGraph& graph, const std::vector<float>& drive, const std::vector<float>& fields,
            size_t node, size_t f) {
  double sum = drive[node * kFields + f];
  for (size_t d = 6 * node; d < 6 * node + 6; ++d)
    sum += double(graph.conductance[d]) * fields[size_t(graph.neighbours[d]) * kFields + f];
  return sum;
}

void Sweep(const HarmonicGraph& graph, const std::vector<float>& drive, float omega,
           std::vector<float>& fields) {
  for (size_t node = 0; node < size_t(graph.size()); ++node) {  // the first colour comes first
    for (size_t f = 0; f < kFields; ++f) {
      float& value = fields[node * kFields + f];
      const double sum = Pull(graph, drive, fields, node, f);
      value = float(value + omega * (sum * graph.inverse_diagonal[node] - value));
    }
  }
}

// The residuals of all nodes, those that are nought by the sweep before among them.
std::vector<float> Restricted(const HarmonicLevels& levels, size_t level, const std::vector<float>& drive,
                              const std::vector<float>& fields) {
  const HarmonicGraph& graph = levels.graphs[level];
  std::vector<double> sums(size_t(levels.graphs[level + 1].size()) * kFields, 0.0);
  for (size_t node = 0; node < size_t(graph.size()); ++node) {
    if (graph.inverse_diagonal[node] == 0) continue;
    const size_t coarse = size_t(levels.transfers[level].around[4 * node]);
    for (size_t f = 0; f < kFields; ++f) {
      sums[coarse * kFields + f] += Pull(graph, drive, fields, node, f) -
                                    double(fields[node * kFields + f]) / graph.inverse_diagonal[node];
    }
  }
  return {sums.begin(), sums.end()};
}

}  // namespace

void HarmonicCycle(const HarmonicLevels& levels, const std::vector<float>& drive, std::vector<float>& fields,
                   size_t level) {
  const HarmonicGraph& graph = levels.graphs[level];
  if (level + 1 == levels.graphs.size()) {
    for (int sweep = 0; sweep < kCoarsestSweeps; ++sweep) Sweep(graph, drive, kCoarsestOmega, fields);
    return;
  }
  Sweep(graph, drive, 1, fields);
  const std::vector<float> coarse_drive = Restricted(levels, level, drive, fields);
  std::vector<float> coarse(coarse_drive.size(), 0.0f);
  for (int visit = 0; visit < kVisits; ++visit) HarmonicCycle(levels, coarse_drive, coarse, level + 1);
  const std::vector<int32_t>& around = levels.transfers[level].around;
  for (size_t n = 0; n < fields.size(); ++n) {
    const size_t node = n / kFields, f = n % kFields;
    double step = 0;
    for (size_t a = 4 * node; a < 4 * node + 4; ++a) step += 0.25 * coarse[size_t(around[a]) * kFields + f];
    fields[n] = float(fields[n] + step);
  }
  Sweep(graph, drive, 1, fields);
}

}  // namespace kvx::reference
