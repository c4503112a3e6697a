// Displacements between levels, and the map template -> scan that they end in.
#pragma once
#include "kernels/block_level.h"
#include "pipeline/registration/level_builder.h"

namespace kvx {

// The field of a level on the next finer one (trilinear), held at 0 where the finer level's mobility is 0.
std::vector<FieldVector> Refined(const std::vector<FieldVector>& field, const BlockLevel& coarse, const BlockLevel& fine);

// v-hat(v) - v with v-hat = (sum_j w_j T_j)(v + d(v)) on the weights' grid (eq. 6); beyond the region d goes on constant.
DisplacementField ComposeWithBlend(const WeightMap& weights, const PoseVector& scan_from_template, const WorkRegion& region,
                                   const std::vector<FieldVector>& field);

// Share of the body's voxels where the map x + u(x) does not keep its orientation (central differences).
double FoldedFraction(const DisplacementField& field, const Mask& body);

}  // namespace kvx
