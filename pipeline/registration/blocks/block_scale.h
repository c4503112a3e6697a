// All blocks of one width, and how each is solved.
#pragma once
#include "kernels/block_kernels.h"
#include "pipeline/registration/blocks/block_lattice.h"
#include "pipeline/registration/blocks/block_solver.h"

namespace kvx {

struct BlockScale {
  BlockWidth width;
  const BlockLevel& level;  // as blocks of this width see it
  BlockLattice lattice;
  BlockSolver solver;

  BlockScale(BlockWidth its_width, const BlockLevel& its_level);

  // Wide blocks always: what others do in their supports they are not told.
  bool Awake(const BlockLattice::Block& block) const;
  // Of the prior in the middle of the block.
  double Firmness(const BlockLattice::Block& block) const;
};

}  // namespace kvx
