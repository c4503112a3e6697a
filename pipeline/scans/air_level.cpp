// Otsu's two classes, then the lower half of the darker one: tissue that strays into that class lies above
// its median.
#include "pipeline/scans/air_level.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/quantile.h"
#include "core/value_range.h"
#include "pipeline/scans/extremes.h"

namespace kvx {
namespace {

constexpr double kCtAirHu = -500;     // CT: half way between air and water; a darker class above it is tissue
constexpr double kCtAirShare = 0.01;  // of a CT's voxels at least are air
constexpr double kFatHu = -50, kFatShare = 0.001;
constexpr size_t kGreysOfScans = 64;  // and more, of the sample
constexpr double kFarAbove = 3;       // times the range of greys: nothing is scanned so far above zero
constexpr double kBelowZero = 0.02;   // of the range of greys; interpolation reaches less far below zero
// MR: air at most this part of tissue (Rician mean at a signal-to-noise of 4)
constexpr double kMostMrNoise = 0.35;

// Air of one value beside greys of many is no scanner's, nor does a calculated CT have that.
bool IsFilling(const std::vector<float>& air, const std::vector<float>& others) {
  const auto [least, most] = std::ranges::minmax(air);
  return least == most && std::set(others.begin(), others.end()).size() > kGreysOfScans;
}

bool ShowsAirOfCt(std::vector<float> sample) {
  if (TakeQuantile(sample, kCtAirShare) >= kCtAirHu) return false;
  const auto fat = std::ranges::count_if(sample, [](float v) { return v >= kCtAirHu && v < kFatHu; });
  const auto others = std::partition(sample.begin(), sample.end(), [](float v) { return v < kCtAirHu; });
  const std::vector<float> air(sample.begin(), others);
  sample.erase(sample.begin(), others);
  if (sample.empty()) return true;
  const bool without_fat = double(fat) < kFatShare * double(air.size() + sample.size());
  if (without_fat && IsFilling(air, sample)) return false;
  return TakeMedian(sample) < kMostTissueHu;
}

// How far nearly all greys reach, and what no signal reads as among them.
struct Greys {
  explicit Greys(std::vector<float> sample) {
    const double low = TakeQuantile(sample, kStrayShare);
    most = TakeQuantile(sample, 1 - kStrayShare), range = most - low;
    zero = low > kFarAbove * range || low < -kBelowZero * range ? low : 0.0;
  }
  double most, range, zero;
};

}  // namespace

double OtsuThreshold(const std::vector<float>& values) {
  constexpr int kBins = 512;
  const auto [low, high] = PlausibleRangeOf(values);
  const double scale = high > low ? kBins / (double(high) - low) : 0.0;
  std::vector<double> count(kBins, 0.0);
  for (const float v : values)
    count[std::min(kBins - 1, int((double(std::clamp(v, low, high)) - low) * scale))] += 1;
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

bool IsHounsfield(const Volume& volume, const std::string& modality) {
  return modality.empty() ? ShowsAirOfCt(SampleOf<float>(volume.values)) : modality == "CT";
}

bool ContradictsCt(const Volume& volume) {
  std::vector<float> sample = SampleOf<float>(volume.values);
  return TakeQuantile(sample, kFatShare) >= kFatHu;
}

double ZeroLevelOf(const Volume& mr) { return Greys(SampleOf<float>(mr.values)).zero; }

std::optional<double> ZeroInPlaceOf(float value, const Volume& scan) {
  std::vector<float> others = SampleOf<float>(scan.values);
  std::erase(others, value);
  if (others.empty()) return std::nullopt;
  const Greys greys(std::move(others));
  const double far = kFarAbove * greys.range;
  const double least = greys.zero < 0 ? greys.zero - far : -kBelowZero * greys.range;
  const bool possible = greys.range == 0 || (value >= least && value <= greys.most + far);
  return possible ? std::nullopt : std::optional(greys.zero);
}

std::optional<AirLevel> FindAirLevel(const Volume& volume, const std::string& modality) {
  std::vector<float> sample = SampleOf<float>(volume.values);
  const bool hounsfield = modality.empty() ? ShowsAirOfCt(sample) : modality == "CT";
  const GreyLimits limits = GreyLimitsOf(sample, hounsfield);
  for (float& grey : sample) grey = limits(grey);
  const double threshold = OtsuThreshold(sample);
  std::vector<float> dark, bright;
  for (const float v : sample) (v < threshold ? dark : bright).push_back(v);
  if (dark.empty() || bright.empty()) return std::nullopt;
  const double air = TakeMedian(dark);
  const AirLevel level{air, air - TakeQuantile(dark, 0.16), TakeMedian(bright)};
  if (hounsfield) return air > kCtAirHu ? std::nullopt : std::optional(level);
  const double zero = Greys(sample).zero;
  return air - zero > kMostMrNoise * (level.tissue - zero) ? std::nullopt : std::optional(level);
}

bool IsMagnitude(const Volume& volume) {
  const ValueRange range = UsualRangeOf(volume.values);
  return range.least > -0.25f * range.most;
}

}  // namespace kvx
