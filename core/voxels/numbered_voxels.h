// How many voxels have each number of an image, and the numbers by that.
#pragma once
#include <algorithm>
#include <numeric>

#include "core/image.h"

namespace kvx {

// By number, from 0 to the largest there is.
template <class Number>
std::vector<size_t> VoxelsByNumber(const Image<Number>& numbers) {
  std::vector<size_t> voxels(size_t(*std::ranges::max_element(numbers.values)) + 1, 0);
  for (const Number number : numbers.values) ++voxels[size_t(number)];
  return voxels;
}

// The numbers but 0; those of as many voxels in their order.
inline std::vector<size_t> LargestFirst(const std::vector<size_t>& voxels) {
  std::vector<size_t> numbers(voxels.size() - 1);
  std::iota(numbers.begin(), numbers.end(), size_t(1));
  std::ranges::stable_sort(numbers, [&](size_t a, size_t b) { return voxels[a] > voxels[b]; });
  return numbers;
}

}  // namespace kvx
