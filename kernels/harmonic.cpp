// The host side of kernels/cl/harmonic_sweep.cl.
#include "kernels/harmonic.h"

#include <algorithm>

#include "kernels/device_buffer.h"
#include "kernels/launch.h"

namespace kvx {
namespace {

// The test for convergence reads a buffer back: rarely enough to cost nothing.
constexpr int kSweepsPerTest = 8;

}  // namespace

HarmonicSolver::HarmonicSolver(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("harmonic_sweep.cl")) {}

int HarmonicSolver::operator()(const HarmonicGraph& graph, const std::vector<float>& anchors,
                               const SweepOptions& options, std::vector<float>& fields) const {
  if (graph.size() == 0) return 0;
  using Floats = DeviceBuffer<float>;
  const auto neighbours = DeviceBuffer<int32_t>::Shared(backend_, graph.neighbours);
  const Floats conductance = Floats::Shared(backend_, graph.conductance);
  const Floats inverse_diagonal = Floats::Shared(backend_, graph.inverse_diagonal);
  const Floats anchor = Floats::Shared(backend_, anchors);
  const DeviceBuffer<float> values(backend_, std::span<const float>(fields));
  const DeviceBuffer<float> change(backend_, size_t(graph.size()));
  const auto sweep_colour = [&](int first, int count) {
    if (count == 0) return;
    cl::Kernel kernel(program_, "harmonic_sweep");
    SetArgs(kernel, cl_int(first), cl_int(count), options.omega, neighbours.buffer(), conductance.buffer(),
            inverse_diagonal.buffer(), anchor.buffer(), values.buffer(), change.buffer());
    Enqueue(backend_.queue(), kernel, size_t(count));
  };
  int sweeps = 0;
  while (sweeps < options.max_sweeps) {
    sweep_colour(0, graph.first_colour_count);
    sweep_colour(graph.first_colour_count, graph.size() - graph.first_colour_count);
    if (++sweeps % kSweepsPerTest != 0) continue;
    const std::vector<float> moved = change.Download(backend_.queue());
    if (*std::max_element(moved.begin(), moved.end()) < options.tolerance) break;
  }
  values.Download(backend_.queue(), fields);
  return sweeps;
}

}  // namespace kvx
