// Line 10 of Algorithm 1: the best displacements of one block's control points.
#pragma once
#include "pipeline/registration/paper/block_window.h"
#include "pipeline/registration/paper/simplex.h"

namespace kvx {

constexpr int kSimplexStarts = 4;  // one from rest, the others at random

struct BlockOptimum {
  std::vector<double> displacements;  // as BlockWindow takes them; empty: nothing is better than rest
  double gain = 0;                    // of the mismatch over B*
};

// The same seed gives the same result, whatever the number of threads.
BlockOptimum OptimiseBlock(const BlockWindow& window, uint64_t seed);

}  // namespace kvx
