// The least and the greatest of many values, with or without strays.
#pragma once
#include <algorithm>
#include <limits>
#include <span>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"

namespace kvx {

struct ValueRange {
  float least = std::numeric_limits<float>::infinity(), most = -std::numeric_limits<float>::infinity();
  ValueRange& operator+=(const ValueRange& other) {
    least = std::min(least, other.least), most = std::max(most, other.most);
    return *this;
  }
};

// Of no values, `least` lies above `most`.
ValueRange ValueRangeOf(std::span<const float> values);

// Of the voxels of an image that may read anything: a hot pixel, metal, a mark that a program left.
constexpr double kStrayShare = 0.001;

// Without that share at either end, as a sample has it; all of the range where nearly all values are one.
inline ValueRange UsualRangeOf(std::span<const float> values) {
  std::vector<float> sample = SampleOf(values);
  if (sample.empty()) return {};
  const float least = TakeQuantile(sample, kStrayShare), most = TakeQuantile(sample, 1 - kStrayShare);
  return least < most ? ValueRange{least, most} : ValueRangeOf(values);
}

// Beyond these lie strays: farther beyond the usual range than that is wide.
inline ValueRange StrayLimitsOf(std::span<const float> values) {
  const ValueRange usual = UsualRangeOf(values);
  const float width = usual.most - usual.least;
  return {usual.least - width, usual.most + width};
}

// Of all values, to where strays begin.
inline ValueRange PlausibleRangeOf(std::span<const float> values) {
  const ValueRange all = ValueRangeOf(values), limits = StrayLimitsOf(values);
  return {std::max(all.least, limits.least), std::min(all.most, limits.most)};
}

// Of all values but strays.
inline ValueRange RangeWithoutStraysOf(std::span<const float> values) {
  const ValueRange limits = StrayLimitsOf(values);
  return ParallelSum<ValueRange>(values.size(), [&](ValueRange& so_far, size_t v) {
    const float value = values[v];
    if (value >= limits.least && value <= limits.most) so_far += {value, value};
  });
}

}  // namespace kvx
