// The voxels that touch one, corner to corner.
#pragma once
#include "core/grid.h"

namespace kvx {

// Calls visit(index) for each of the 26 that the grid holds.
template <class Visit>
void ForEachNeighbour(const Grid& grid, size_t at, Visit&& visit) {
  const Eigen::Vector3i p = grid.Ijk(at);
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i q = p + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if (n != 13 && grid.Contains(q)) visit(grid.Index(q.x(), q.y(), q.z()));
  }
}

}  // namespace kvx
