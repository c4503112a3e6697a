// The same voxels in another order: as other scanners and programs store them.
#pragma once
#include <array>

#include "core/grid.h"

namespace kvx::testing_support {

// Axis n of the turned grid is `axes[n]` of the grid, run backwards where `backwards[n]`.
struct Turn {
  std::array<int, 3> axes;
  std::array<bool, 3> backwards;
};

inline const std::array<Turn, 6> kTurns{{{{0, 1, 2}, {true, false, false}},
                                         {{0, 1, 2}, {false, true, true}},
                                         {{1, 0, 2}, {false, false, false}},
                                         {{2, 0, 1}, {false, true, false}},
                                         {{1, 2, 0}, {true, true, true}},
                                         {{2, 1, 0}, {false, false, true}}}};

inline Grid Turned(const Grid& grid, const Turn& turn) {
  Grid out = grid;
  for (size_t n = 0; n < 3; ++n) {
    const int axis = turn.axes[n];
    out.size[int(n)] = grid.size[axis];
    out.spacing_mm[int(n)] = grid.spacing_mm[axis];
    out.direction.col(int(n)) = grid.direction.col(axis);
    if (!turn.backwards[n]) continue;
    out.direction.col(int(n)) *= -1;
    out.origin.lps += (grid.size[axis] - 1) * grid.spacing_mm[axis] * grid.direction.col(axis);
  }
  return out;
}

}  // namespace kvx::testing_support
