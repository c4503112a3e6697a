// Cuts the template's body, weights and examples into the bricks that the posing kernels read.
#pragma once
#include <functional>
#include <memory>

#include "kernels/bricked_body.h"
#include "pipeline/posing/posing_engine.h"

namespace kvx {

constexpr int kMarginVoxels = 2;  // of air carried along, so that the skin's half-filled voxels are

using ExampleLoader = std::function<std::shared_ptr<const DisplacementField>(size_t k)>;

// `example`: d_k of a training scan; asked for one after the other, and let go before the next. All on one
// grid.
BrickedBody BrickBody(const Mask& body, const BoneSet& bones, const WeightMap& weights, size_t examples,
                      const ExampleLoader& example);
BrickedBody BrickBody(const PosingInputs& inputs);

}  // namespace kvx
