// The host side of kernels/cl/harmonic.cl.
#include "kernels/harmonic.h"

#include <algorithm>
#include <cmath>

#include "kernels/device/device_buffer.h"
#include "kernels/device/launch.h"

namespace kvx {
namespace {

// Of an error, after a cycle, at best and at worst.
constexpr float kLeastLeft = 0.1f, kMostLeft = 0.999f;

// What cycles still to come would change, going on as the last third of those done: the sum of a geometric
// series. One cycle's ratio would not do, for the largest change wanders among the nodes.
float LeftAfter(const std::vector<float>& changes) {
  const size_t last = changes.size() - 1, middle = 2 * last / 3;
  if (changes[last] == 0) return 0;
  const float steps = float(std::max<size_t>(last - middle, 1));
  const float left = std::clamp(std::pow(changes[last] / changes[middle], 1 / steps), kLeastLeft, kMostLeft);
  return changes[last] * left / (1 - left);
}

using Floats = DeviceBuffer<float>;
using Numbers = DeviceBuffer<int32_t>;

// What a level of a cycle lives in. Of a coarser level the fields are corrections, driven by residuals.
struct LevelBuffers {
  LevelBuffers(Backend& backend, const HarmonicGraph& graph)
      : nodes(graph.size()),
        first_colour(graph.first_colour_count),
        neighbours(Numbers::Shared(backend, graph.neighbours)),
        conductance(Floats::Shared(backend, graph.conductance)),
        inverse_diagonal(Floats::Shared(backend, graph.inverse_diagonal)) {}

  int nodes, first_colour;
  Numbers neighbours;
  Floats conductance, inverse_diagonal, drive, fields;
  Numbers around, children;  // to and from the next coarser level
};

class Cycles {
 public:
  Cycles(Backend& backend, const cl::Program& program, const HarmonicLevels& levels,
         const std::vector<float>& anchors, const std::vector<float>& fields)
      : queue_(backend.queue()),
        sweep_(program, "harmonic_sweep"),
        restrict_(program, "harmonic_restrict"),
        correct_(program, "harmonic_correct"),
        change_(program, "harmonic_change"),
        before_(backend, std::span<const float>(fields)),
        changes_(backend, size_t(levels.graphs.front().size())) {
    for (size_t l = 0; l < levels.graphs.size(); ++l) {
      LevelBuffers& level = levels_.emplace_back(backend, levels.graphs[l]);
      const size_t values = size_t(level.nodes) * kFieldsPerSolve;
      level.drive = l == 0 ? Floats::Shared(backend, anchors) : Floats(backend, values);
      level.fields = l == 0 ? Floats(backend, std::span<const float>(fields)) : Floats(backend, values);
      if (l + 1 == levels.graphs.size()) continue;
      level.around = Numbers::Shared(backend, levels.transfers[l].around);
      level.children = Numbers::Shared(backend, levels.transfers[l].children);
    }
  }

  void Run(size_t l = 0) {
    if (l + 1 == levels_.size()) {
      for (int sweep = 0; sweep < kCoarsestSweeps; ++sweep) Sweep(levels_[l], kCoarsestOmega);
      return;
    }
    LevelBuffers &level = levels_[l], &coarse = levels_[l + 1];
    Sweep(level, 1);
    Restrict(level, coarse);
    for (int visit = 0; visit < kVisits; ++visit) Run(l + 1);
    Correct(level, coarse);
    Sweep(level, 1);
  }

  // Of the fields since it was last asked, or since the start.
  float LargestChange() {
    LevelBuffers& finest = levels_.front();
    SetArgs(change_, cl_int(finest.nodes), finest.fields.buffer(), before_.buffer(), changes_.buffer());
    Enqueue(queue_, change_, size_t(finest.nodes));
    const std::vector<float> changes = changes_.Download(queue_);
    return *std::ranges::max_element(changes);
  }

  void Download(std::vector<float>& fields) const { levels_.front().fields.Download(queue_, fields); }

 private:
  void Sweep(LevelBuffers& level, float omega) {
    SweepColour(level, omega, 0, level.first_colour);
    SweepColour(level, omega, level.first_colour, level.nodes - level.first_colour);
  }

  void SweepColour(LevelBuffers& level, float omega, int first, int count) {
    if (count == 0) return;
    SetArgs(sweep_, cl_int(first), cl_int(count), omega, level.neighbours.buffer(),
            level.conductance.buffer(), level.inverse_diagonal.buffer(), level.drive.buffer(),
            level.fields.buffer());
    Enqueue(queue_, sweep_, size_t(count));
  }

  void Restrict(LevelBuffers& level, LevelBuffers& coarse) {
    SetArgs(restrict_, cl_int(coarse.nodes), level.children.buffer(), level.neighbours.buffer(),
            level.conductance.buffer(), level.inverse_diagonal.buffer(), level.drive.buffer(),
            level.fields.buffer(), coarse.drive.buffer());
    Enqueue(queue_, restrict_, size_t(coarse.nodes));
    coarse.fields.Fill(queue_, 0.0f);
  }

  void Correct(LevelBuffers& level, LevelBuffers& coarse) {
    SetArgs(correct_, cl_int(level.nodes), level.around.buffer(), coarse.fields.buffer(),
            level.fields.buffer());
    Enqueue(queue_, correct_, size_t(level.nodes));
  }

  cl::CommandQueue& queue_;
  cl::Kernel sweep_, restrict_, correct_, change_;
  std::vector<LevelBuffers> levels_;
  Floats before_, changes_;
};

}  // namespace

HarmonicSolver::HarmonicSolver(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("harmonic.cl")) {}

int HarmonicSolver::operator()(const HarmonicLevels& levels, const std::vector<float>& anchors,
                               const CycleOptions& options, std::vector<float>& fields) const {
  if (fields.empty()) return 0;
  Cycles cycles(backend_, program_, levels, anchors, fields);
  std::vector<float> changes;
  do {
    cycles.Run();
    changes.push_back(cycles.LargestChange());
  } while (LeftAfter(changes) >= options.tolerance && int(changes.size()) < options.max_cycles);
  cycles.Download(fields);
  return int(changes.size());
}

}  // namespace kvx
