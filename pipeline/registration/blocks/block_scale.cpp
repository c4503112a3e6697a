#include "pipeline/registration/blocks/block_scale.h"

#include <algorithm>

namespace kvx {

BlockScale::BlockScale(BlockWidth its_width, const BlockLevel& its_level)
    : width(its_width), level(its_level), lattice(its_level), solver(BlockSpline(), its_level) {}

bool BlockScale::Awake(const BlockLattice::Block& block) const {
  return width == BlockWidth::kWide || lattice.Awake(block);
}

double BlockScale::Firmness(const BlockLattice::Block& block) const {
  const Grid cells = Coarsened(level.grid, 2);
  Eigen::Vector3i p;
  for (int a = 0; a < 3; ++a)
    p[a] = std::clamp((block.support.s[a] + kSupportVoxels / 2) / 2, 0, cells.size[a] - 1);
  return level.firmness[cells.Index(p.x(), p.y(), p.z())];
}

}  // namespace kvx
