// The voxels around one: those beside it by faces, or all, corner to corner.
#pragma once
#include "core/grid.h"

namespace kvx {

// To the voxel beside another on one of its six sides: back and forth along i, j, k.
inline Eigen::Vector3i StepToSide(int side) { return (side % 2 ? 1 : -1) * Eigen::Vector3i::Unit(side / 2); }

// Calls visit(index) for the voxel and its 26 neighbours as far as the grid holds them, i fastest.
template <class Visit>
void ForEachAround(const Grid& grid, size_t at, Visit&& visit) {
  const Eigen::Vector3i p = grid.Ijk(at);
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i q = p + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if (grid.Contains(q)) visit(grid.Index(q.x(), q.y(), q.z()));
  }
}

// The same without the voxel itself.
template <class Visit>
void ForEachNeighbour(const Grid& grid, size_t at, Visit&& visit) {
  ForEachAround(grid, at, [&](size_t beside) {
    if (beside != at) visit(beside);
  });
}

}  // namespace kvx
