// Quantiles of some values, without sorting them.
#pragma once
#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace kvx {

// The value that `fraction` (0..1) of all are before in order. `values`: not empty; reordered, the smaller
// ones first.
template <class T>
T TakeQuantile(std::vector<T>& values, double fraction) {
  const size_t rank = std::min(values.size() - 1, size_t(fraction * double(values.size())));
  const auto at = values.begin() + std::ptrdiff_t(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Enough of many values for quantiles: every n-th.
template <class T>
std::vector<T> SampleOf(std::span<const T> values) {
  constexpr size_t kSamples = 1000003;
  const size_t step = values.size() / kSamples + 1;
  std::vector<T> sample;
  sample.reserve(values.size() / step + 1);
  for (size_t v = 0; v < values.size(); v += step) sample.push_back(values[v]);
  return sample;
}

constexpr double kSdOfMad = 1.4826;    // normal: standard deviations in a median distance from the median
constexpr double kMadOfPairs = 0.954;  // normal: median difference of two values, in standard deviations

// Of an even number the upper of the two in the middle.
template <class T>
T TakeMedian(std::vector<T>& values) {
  return TakeQuantile(values, 0.5);
}

}  // namespace kvx
