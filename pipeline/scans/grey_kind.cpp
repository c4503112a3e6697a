// Quantiles of a sample of the greys.
#include "pipeline/scans/grey_kind.h"

#include <algorithm>
#include <set>
#include <utility>

#include "core/numbers/quantile.h"
#include "core/numbers/value_range.h"
#include "pipeline/scans/extremes.h"

namespace kvx {
namespace {

constexpr double kCtAirShare = 0.01;  // of a CT's voxels at least are air
constexpr double kFatHu = -50, kFatShare = 0.001;
constexpr size_t kGreysOfScans = 64;  // and more, of the sample
constexpr double kFarAbove = 3;       // times the range of greys: nothing is scanned so far above zero
constexpr double kBelowZero = 0.02;   // of the range of greys; interpolation reaches less far below zero

// Air of one value beside greys of many is no scanner's, nor does a calculated CT have that.
bool IsFilling(const std::vector<float>& air, const std::vector<float>& others) {
  const auto [least, most] = std::ranges::minmax(air);
  return least == most && std::set(others.begin(), others.end()).size() > kGreysOfScans;
}

// Nothing is as light.
bool LiesBelowHounsfield(std::vector<float> sample) {
  return TakeQuantile(sample, 1 - kStrayShare) <= kLeastHu;
}

bool ShowsAirOfCt(std::vector<float> sample) {
  if (LiesBelowHounsfield(sample)) return false;
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

bool IsHounsfield(const Volume& volume, const std::string& modality) {
  if (!modality.empty()) return modality == "CT";
  if (ValueRangeOf(volume.values).least >= kCtAirHu) return false;  // without a look at quantiles
  return ShowsAirOfCt(SampleOf<float>(volume.values));
}

bool IsHounsfield(const std::vector<float>& greys, const std::string& modality) {
  return modality.empty() ? ShowsAirOfCt(greys) : modality == "CT";
}

bool ContradictsCt(const Volume& volume) {
  std::vector<float> sample = SampleOf<float>(volume.values);
  return LiesBelowHounsfield(sample) || TakeQuantile(sample, kFatShare) >= kFatHu;
}

double ZeroLevelOf(std::vector<float> greys) { return Greys(std::move(greys)).zero; }

double ZeroLevelOf(const Volume& mr) { return ZeroLevelOf(SampleOf<float>(mr.values)); }

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

bool IsMagnitude(const Volume& volume) {
  const ValueRange all = ValueRangeOf(volume.values);
  if (all.least >= 0 && all.most > 0) return true;  // whatever the usual range is
  const ValueRange range = UsualRangeOf(volume.values);
  return range.least > -0.25f * range.most;
}

}  // namespace kvx
