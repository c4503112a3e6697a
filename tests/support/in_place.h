// A start or a map that leaves everything where it is.
#pragma once
#include <vector>

#include "core/grid.h"

namespace kvx::testing_support {

// Where every voxel of the grid lies, mm.
inline std::vector<Eigen::Vector3f> InPlace(const Grid& grid) {
  std::vector<Eigen::Vector3f> places_mm;
  for (size_t v = 0; v < grid.VoxelCount(); ++v)
    places_mm.push_back(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps.cast<float>());
  return places_mm;
}

}  // namespace kvx::testing_support
