// The host side of kernels/cl/bone_scores.cl.
#include "kernels/bone_scores.h"

#include <cmath>

#include "kernels/launch.h"

namespace kvx {

double Correlation(const CorrelationSums& sums) {
  if (sums.count < 2) return 0;
  const double n = sums.count, t = sums.t / n, s = sums.s / n;
  const double tt = sums.tt / n - t * t, ss = sums.ss / n - s * s, ts = sums.ts / n - t * s;
  constexpr double kNoContrast = 1e-6;  // of values scaled to about 1
  if (tt < kNoContrast || ss < kNoContrast) return 0;
  return ts / std::sqrt(tt * ss);
}

BoneScores::BoneScores(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("bone_scores.cl")) {}

std::vector<CorrelationSums> BoneScores::operator()(const DeviceScan& scan,
                                                    std::span<const BoneSample> samples,
                                                    std::span<const VoxFromSample> candidates) const {
  if (candidates.empty()) return {};
  const DeviceBuffer<BoneSample> points(backend_, samples);
  const DeviceBuffer<VoxFromSample> poses(backend_, candidates);
  const DeviceBuffer<CorrelationSums> sums(backend_, candidates.size());
  const cl_int4 size = {{scan.grid.size.x(), scan.grid.size.y(), scan.grid.size.z(), 0}};
  cl::Kernel kernel(program_, "bone_scores");
  SetArgs(kernel, scan.values.buffer(), size, points.buffer(), cl_int(samples.size()), poses.buffer(),
          cl_int(candidates.size()), sums.buffer());
  Enqueue(backend_.queue(), kernel, candidates.size());
  return sums.Download(backend_.queue());
}

}  // namespace kvx
