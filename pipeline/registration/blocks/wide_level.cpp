#include "pipeline/registration/blocks/wide_level.h"

namespace kvx {

BlockLevel WideLevel(const BlockLevel& level) {
  BlockLevel out;
  out.grid = Coarsened(level.grid, 2);
  out.template_voxels = 2 * level.template_voxels;
  out.intensity = CellMeans(level.grid, level.intensity);
  out.weight = CellMeans(level.grid, level.weight);
  out.firmness = CellMeans(Coarsened(level.grid, 2), level.firmness);
  out.bending = level.bending;
  return out;
}

}  // namespace kvx
