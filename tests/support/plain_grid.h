// Grids along the axes of the world.
#pragma once
#include "core/grid.h"

namespace kvx::testing_support {

inline Grid PlainGrid(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm,
                      const Eigen::Vector3d& origin_lps) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.origin.lps = origin_lps;
  return grid;
}

// Of cubes, from 0 on.
inline Grid Cubes(const Eigen::Vector3i& size, double edge_mm) {
  return PlainGrid(size, Eigen::Vector3d::Constant(edge_mm), Eigen::Vector3d::Zero());
}

}  // namespace kvx::testing_support
