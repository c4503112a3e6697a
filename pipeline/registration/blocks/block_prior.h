// How stiff a level's field is: the strength of the bending energy, place by place.
#pragma once
#include "kernels/block_level.h"

namespace kvx {

// Of the prior beside what is usual, per cell of the level that it was measured on: the better the start, the
// less is left to bend.
struct Firmness {
  Grid grid;  // of the level
  int template_voxels = 1;
  std::vector<float> values;
};
// `residual_voxels`: StartResidual around every cell.
Firmness MeasureFirmness(const BlockLevel& start, std::vector<float> residual_voxels);

// Of two estimates; the second alone where they were measured on different levels.
Firmness GeometricMean(const Firmness& earlier, const Firmness& later);

// Fills bending, stiffness and firmness. `reach_mm`: farther from the body than that, the field is in air.
void ApplyPrior(const Firmness& firmness, const Volume& body_distance_mm, double reach_mm, BlockLevel& level);

}  // namespace kvx
