// Quantiles say what is far.
#include "pipeline/scans/extremes.h"

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr float kMetalHu =
    3071;  // the most that 12 bits hold: denser than bone, and all that is denser still

bool AnyBeyond(const GreyLimits& limits, const Volume& volume) {
  const auto beyond = ParallelSum<size_t>(volume.values.size(), [&](size_t& so_far, size_t v) {
    so_far += limits(volume.values[v]) != volume.values[v];
  });
  return beyond > 0;
}

}  // namespace

GreyLimits GreyLimitsOf(std::span<const float> values, bool hounsfield) {
  GreyLimits limits{.range = PlausibleRangeOf(values)};
  if (hounsfield) limits.metal = kMetalHu;
  return limits;
}

OwnOrLent<Volume> WithoutExtremes(const Volume& volume, bool hounsfield) {
  const GreyLimits limits = GreyLimitsOf(volume.values, hounsfield);
  if (!AnyBeyond(limits, volume)) return volume;
  Volume out = volume;
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = limits(out.values[v]); });
  return out;
}

}  // namespace kvx
