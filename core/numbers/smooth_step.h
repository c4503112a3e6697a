// A fade without kinks at its ends.
#pragma once
#include <algorithm>

namespace kvx {

// 0 up to `low`, 1 from `high` on, smooth to the first derivative: 3 t^2 - 2 t^3 between.
inline double SmoothStep(double low, double high, double value) {
  const double t = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace kvx
