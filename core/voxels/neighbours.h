// The voxels around one, corner to corner, as far as the grid holds them.
#pragma once
#include "core/grid.h"

namespace kvx {

// Calls visit(index) for the voxel and its 26 neighbours, i fastest.
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
