// The starts are independent of each other, and run side by side.
#include "pipeline/registration/paper/block_optimiser.h"

#include <algorithm>
#include <random>

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr double kBound = 0.35 * kBlockVoxels;  // per axis; a step does not fold up to 0.42 block widths
constexpr double kFirstStep = 0.1 * kBlockVoxels;
constexpr double kRandomShift = 0.2 * kBlockVoxels;  // of the whole block, at a random start
constexpr double kRandomBend = 0.05 * kBlockVoxels;  // of its control points, besides
constexpr double kLeastStep = 0.02;                  // voxels
constexpr double kLeastGain = 1e-4;
constexpr int kEvaluationsPerParameter = 40;

// Uniform in -1 .. 1, the same on every platform (the library's distributions are not).
double Uniform(std::mt19937_64& random) { return 2.0 * double(random() >> 11) / double(1ULL << 53) - 1.0; }

std::vector<double> RandomStart(int parameters, uint64_t seed, size_t start) {
  std::seed_seq words{uint32_t(seed), uint32_t(seed >> 32), uint32_t(start)};
  std::mt19937_64 random(words);
  std::vector<double> out;
  for (int axis = 0; axis < 3; ++axis) {
    const double shift = kRandomShift * Uniform(random);
    for (int a = 0; a < parameters / 3; ++a) out.push_back(shift + kRandomBend * Uniform(random));
  }
  return out;
}

}  // namespace

BlockOptimum OptimiseBlock(const BlockWindow& window, uint64_t seed) {
  const int parameters = window.parameters();
  if (parameters == 0) return {};
  const SimplexOptions options{kBound, kFirstStep, kLeastStep, kLeastGain,
                               kEvaluationsPerParameter * parameters};
  const std::vector<double> rest(size_t(parameters), 0.0);
  std::vector<SimplexResult> results(kSimplexStarts);
  ParallelFor(results.size(), [&](size_t start) {
    const auto cost = [&](std::span<const double> f) { return window.Cost(f); };
    results[start] =
        MinimiseBySimplex(cost, start == 0 ? rest : RandomStart(parameters, seed, start), options);
  });
  const auto best = std::ranges::min_element(results, {}, &SimplexResult::value);
  const double gain = window.Cost(rest) - best->value;
  if (!(gain > 0)) return {};
  return {std::move(best->at), gain};
}

}  // namespace kvx
