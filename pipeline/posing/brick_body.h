// Cuts the template's body, weights and examples into the bricks that the posing kernels read.
#pragma once
#include "kernels/bricked_body.h"
#include "pipeline/posing/posing_engine.h"

namespace kvx {

constexpr int kMarginVoxels = 2;  // of air carried along, so that the skin's half-filled voxels are

// `examples`: d_k per training scan. All on one grid.
BrickedBody BrickBody(const Mask& body, const BoneSet& bones, const WeightMap& weights,
                      const std::vector<const DisplacementField*>& examples);
BrickedBody BrickBody(const PosingInputs& inputs);

}  // namespace kvx
