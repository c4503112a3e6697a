// Which posed grids show what is thinner than two of their voxels as no tissue: see cl/evd_mend.cl.
#pragma once
#include "core/grid.h"

namespace kvx {

// On voxels about as fine as the template's; what is thinner than two coarse ones may be a finger.
inline bool HoldsSpecks(const Grid& posed, const Grid& template_grid) {
  constexpr double kMostCoarser = 1.5;
  return posed.spacing_mm.maxCoeff() <= kMostCoarser * template_grid.spacing_mm.maxCoeff();
}

}  // namespace kvx
