// Waves, of which every blur on paper leaves a known part.
#pragma once
#include <cmath>

#include "core/image.h"

namespace kvx::testing_support {

// 100 + 50 cos(wave . x), `per_mm` in rad per mm along each axis of the world.
inline Volume Wave(const Grid& grid, const Eigen::Vector3d& per_mm) {
  Volume wave(grid);
  for (size_t v = 0; v < wave.values.size(); ++v) {
    const Eigen::Vector3d at = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    wave.values[v] = float(100 + 50 * std::cos(per_mm.dot(at)));
  }
  return wave;
}

// A box of width w leaves sin(k w / 2) / (k w / 2) of a wave along it.
inline double LeftByBox(double per_mm, double width_mm) {
  return std::sin(0.5 * per_mm * width_mm) / (0.5 * per_mm * width_mm);
}

}  // namespace kvx::testing_support
