// Grid arithmetic.
#include "core/voxels/finer_grid.h"

#include <algorithm>
#include <cmath>

namespace kvx {

Grid FinerGrid(const Grid& grid, const Eigen::Vector3i& times) {
  Grid finer = grid;
  finer.size = (grid.size.array() - 1) * times.array() + 1;
  finer.spacing_mm.array() /= times.array().cast<double>();
  return finer;
}

Grid CoarserGrid(const Grid& finer, const Eigen::Vector3i& times) {
  Grid grid = finer;
  grid.size = (finer.size.array() - 1) / times.array() + 1;
  grid.spacing_mm.array() *= times.array().cast<double>();
  return grid;
}

Eigen::Vector3i TimesFiner(const Grid& grid, double spacing_mm) {
  Eigen::Vector3i times;
  for (int a = 0; a < 3; ++a)
    times[a] = int(std::clamp(std::lround(grid.spacing_mm[a] / spacing_mm), 1L, long(kMostTimesFiner)));
  return times;
}

Eigen::Vector3i TimesTowardsCubes(const Grid& grid) { return TimesFiner(grid, grid.MeanSpacingMm()); }

}  // namespace kvx
