// Plain loops, double precision.
#include "kernels/reference/bone_scores.h"

namespace kvx::reference {
namespace {

CorrelationSums SumsOf(const Volume& scan, std::span<const BoneSample> samples,
                       const VoxFromSample& vox_from_sample) {
  double count = 0, t = 0, tt = 0, s = 0, ss = 0, ts = 0;
  for (const BoneSample& sample : samples) {
    const PointVox p{
        (vox_from_sample.leftCols<3>() * sample.head<3>() + vox_from_sample.col(3)).cast<double>()};
    if (!scan.grid.Contains(p)) continue;
    const double value = SampleTrilinear(scan, p), w = sample.w();
    count += 1, t += w, tt += w * w, s += value, ss += value * value, ts += w * value;
  }
  return {float(count), float(t), float(tt), float(s), float(ss), float(ts)};
}

}  // namespace

std::vector<CorrelationSums> BoneScores(const Volume& scan, std::span<const BoneSample> samples,
                                        std::span<const VoxFromSample> candidates) {
  std::vector<CorrelationSums> out;
  for (const VoxFromSample& candidate : candidates) out.push_back(SumsOf(scan, samples, candidate));
  return out;
}

}  // namespace kvx::reference
