// An image with the greys of an MR scan, in no order.
#pragma once
#include <algorithm>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx::testing_support {

// Half air of 10 +- 4, half tissue of 100 +- 10, as a scanner stores them; times `gain`, plus `shift`.
inline Volume Mr(float gain = 1, float shift = 0) {
  Volume scan(ObliqueGrid({40, 40, 40}));
  std::mt19937 random(3);
  std::normal_distribution<float> unit;
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const float grey = v % 2 ? 10 + 4 * unit(random) : 100 + 10 * unit(random);
    scan.values[v] = shift + gain * std::max(0.0f, grey);
  }
  return scan;
}

}  // namespace kvx::testing_support
