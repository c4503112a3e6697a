// The middle one of some values.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace kvx {

// Of an even number the upper of the two. `values`: not empty; reordered, the smaller half first.
template <class T>
T TakeMedian(std::vector<T>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace kvx
