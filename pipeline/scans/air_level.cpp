// Otsu's two classes, then the lower half of the darker one: tissue that strays into that class lies above
// its median.
#include "pipeline/scans/air_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/numbers/value_range.h"
#include "pipeline/scans/extremes.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

// MR: air at most this part of tissue (Rician mean at a signal-to-noise of 4)
constexpr double kMostMrNoise = 0.35;

constexpr int kBins = 512;

struct Histogram {
  std::array<double, kBins> count{};
  Histogram& operator+=(const Histogram& other) {
    for (int b = 0; b < kBins; ++b) count[b] += other.count[b];
    return *this;
  }
};

// `scale`: bins per unit of the values, from `low` on.
std::array<double, kBins> HistogramOf(const std::vector<float>& values, float low, float high, double scale) {
  return ParallelSum<Histogram>(values.size(),
                                [&](Histogram& so_far, size_t v) {
                                  const double at = (double(std::clamp(values[v], low, high)) - low) * scale;
                                  so_far.count[std::min(kBins - 1, int(at))] += 1;
                                })
      .count;
}

}  // namespace

double OtsuThreshold(const std::vector<float>& values) {
  const auto [low, high] = PlausibleRangeOf(values);
  const double scale = high > low ? kBins / (double(high) - low) : 0.0;
  const std::array<double, kBins> count = HistogramOf(values, low, high, scale);
  double below = 0, sum_below = 0, sum = 0, best = -1;
  int best_bin = 0, best_end = 0;
  for (int b = 0; b < kBins; ++b) sum += b * count[b];
  for (int b = 0; b + 1 < kBins; ++b) {
    below += count[b], sum_below += b * count[b];
    const double above = double(values.size()) - below;
    if (below == 0 || above == 0) continue;
    const double between = below * above * std::pow(sum_below / below - (sum - sum_below) / above, 2);
    if (between > best) best = between, best_bin = b;
    if (between == best) best_end = b;  // the middle of a plateau between classes far apart
  }
  return scale > 0 ? low + (0.5 * (best_bin + std::max(best_bin, best_end)) + 1) / scale : low;
}

std::optional<AirLevel> FindAirLevel(const Volume& volume, const std::string& modality) {
  std::vector<float> sample = SampleOf<float>(volume.values);
  const bool hounsfield = IsHounsfield(sample, modality);
  const GreyLimits limits = GreyLimitsOf(sample, hounsfield);
  for (float& grey : sample) grey = limits(grey);
  const double threshold = OtsuThreshold(sample);
  std::vector<float> dark, bright;
  for (const float v : sample) (v < threshold ? dark : bright).push_back(v);
  if (dark.empty() || bright.empty()) return std::nullopt;
  const double air = TakeMedian(dark);
  const AirLevel level{air, air - TakeQuantile(dark, 0.16), TakeMedian(bright)};
  if (hounsfield) return air > kCtAirHu ? std::nullopt : std::optional(level);
  const double zero = ZeroLevelOf(std::move(sample));
  return air - zero > kMostMrNoise * (level.tissue - zero) ? std::nullopt : std::optional(level);
}

}  // namespace kvx
