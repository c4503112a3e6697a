// The host side of kernels/cl/bone_scores.cl.
#include "kernels/bone_scores.h"

#include <cmath>

#include "kernels/device/launch.h"

namespace kvx {
namespace {

constexpr size_t kLanes = 8;

size_t BlocksOf(size_t samples) { return (samples + kLanes - 1) / kLanes; }

// Blocks of 8 x, 8 y, 8 z, 8 values. Neighbours in `samples` go to different blocks, so that every block
// covers the whole bone; what is missing in the last ones lies far outside any scan.
std::vector<float> Packed(std::span<const BoneSample> samples) {
  constexpr float kFar = 1e9f;
  const size_t blocks = BlocksOf(samples.size());
  std::vector<float> packed(4 * kLanes * blocks, kFar);
  for (size_t n = 0; n < samples.size(); ++n) {
    float* at = packed.data() + 4 * kLanes * (n % blocks) + n / blocks;
    for (int row = 0; row < 4; ++row) at[kLanes * size_t(row)] = samples[n][row];
  }
  return packed;
}

}  // namespace

double Correlation(const CorrelationSums& sums) {
  if (sums.count < 2) return 0;
  const double n = sums.count, t = sums.t / n, s = sums.s / n;
  const double tt = sums.tt / n - t * t, ss = sums.ss / n - s * s, ts = sums.ts / n - t * s;
  constexpr double kNoContrast = 1e-6;  // of values scaled to about 1
  if (tt < kNoContrast || ss < kNoContrast) return 0;
  return ts / std::sqrt(tt * ss);
}

size_t SamplesAtStep(size_t samples, int step) {
  const size_t blocks = BlocksOf(samples);
  size_t count = 0;
  for (size_t block = 0; block < blocks; block += size_t(step)) {
    count += (samples - block + blocks - 1) / blocks;
  }
  return count;
}

DeviceScan::DeviceScan(Backend& backend, const Volume& scan)
    : grid(scan.grid), values(backend, scan.values.size() + 1) {
  values.Fill(backend.queue(), 0.0f);
  values.Upload(backend.queue(), std::span(scan.values));
}

BoneScores::BoneScores(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("bone_scores.cl")) {}

std::vector<CorrelationSums> BoneScores::operator()(const DeviceScan& scan,
                                                    std::span<const BoneSample> samples,
                                                    std::span<const VoxFromSample> candidates,
                                                    int step) const {
  if (candidates.empty()) return {};
  const std::vector<float> packed = Packed(samples);
  const DeviceBuffer<float> points(backend_, std::span(packed));
  const DeviceBuffer<VoxFromSample> poses(backend_, candidates);
  const DeviceBuffer<CorrelationSums> sums(backend_, candidates.size());
  const cl_int4 size = {{scan.grid.size.x(), scan.grid.size.y(), scan.grid.size.z(), 0}};
  cl::Kernel kernel(program_, "bone_scores");
  SetArgs(kernel, scan.values.buffer(), size, points.buffer(), cl_int(BlocksOf(samples.size())), cl_int(step),
          poses.buffer(), cl_int(candidates.size()), sums.buffer());
  Enqueue(backend_.queue(), kernel, candidates.size());
  return sums.Download(backend_.queue());
}

}  // namespace kvx
