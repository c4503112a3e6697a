// Samples come from the device; histograms are filled on the host, one block per thread at a time.
#include "pipeline/registration/blocks/block_information.h"

#include <cmath>

#include "core/host/parallel.h"
#include "pipeline/registration/blocks/level_greys.h"

namespace kvx {
namespace {

constexpr int kLeastTemplateVoxels = 32;  // along an axis of the support
constexpr double kRangeSpreads = 3;       // of the histogram, to either side of the mean
constexpr size_t kBatch = 128;            // blocks whose samples are held at once: 11 MiB

IntensityRange RangeOf(const BlockLevel& level) {
  const auto [n, sum, squares] = SumsOf(level);
  if (n < 1) return {};
  const double mean = sum / n, spread = std::sqrt(std::max(1e-12, squares / n - mean * mean));
  return {float(mean - kRangeSpreads * spread), float(mean + kRangeSpreads * spread)};
}

}  // namespace

BlockInformation::BlockInformation(const BlockLevel& level)
    : applies_(kSupportVoxels * level.template_voxels >= kLeastTemplateVoxels), range_(RangeOf(level)) {}

std::vector<BlockInformation::Value> BlockInformation::Of(BlockKernels& kernels,
                                                          std::span<const cl_int4> blocks,
                                                          BlockKernels::State state) const {
  std::vector<Value> out(blocks.size());
  const size_t run = kernels.VoxelsPerBall();
  for (size_t first = 0; first < blocks.size(); first += kBatch) {
    const auto batch = blocks.subspan(first, std::min(kBatch, blocks.size() - first));
    const std::vector<float> samples = kernels.Samples(batch, state);
    ParallelEach(batch.size(), [&](size_t b) {
      const auto part = [&](size_t n) { return std::span(samples).subspan((3 * b + n) * run, run); };
      const MutualInformation mi = EstimateMutualInformation(part(0), part(1), part(2), range_, range_);
      Value& value = out[first + b];
      value.normalised = mi.normalised;
      value.entropy_nats = mi.smaller_entropy_nats;
      for (const float counts : part(2)) value.samples += counts;
    });
  }
  return out;
}

double BlockInformation::GainNats(const Value& before, const Value& after) {
  return before.samples * before.entropy_nats * (after.normalised - before.normalised);
}

}  // namespace kvx
