// The least and the greatest of many values.
#pragma once
#include <algorithm>
#include <limits>
#include <span>

#include "core/parallel.h"

namespace kvx {

struct ValueRange {
  float least = std::numeric_limits<float>::infinity(), most = -std::numeric_limits<float>::infinity();
  ValueRange& operator+=(const ValueRange& other) {
    least = std::min(least, other.least), most = std::max(most, other.most);
    return *this;
  }
};

// Of no values, `least` lies above `most`.
inline ValueRange ValueRangeOf(std::span<const float> values) {
  return ParallelSum<ValueRange>(values.size(), [&](ValueRange& so_far, size_t v) {
    so_far += {values[v], values[v]};
  });
}

}  // namespace kvx
