// Sums over the greys of a level's voxels that count.
#pragma once
#include "kernels/block_level.h"

namespace kvx {

struct GreySums {
  double count = 0, sum = 0, squares = 0;
};

inline GreySums SumsOf(const BlockLevel& level) {
  GreySums out;
  for (size_t v = 0; v < level.weight.size(); ++v) {
    if (level.weight[v] <= 0) continue;
    out.count += 1, out.sum += level.intensity[v];
    out.squares += double(level.intensity[v]) * level.intensity[v];
  }
  return out;
}

}  // namespace kvx
