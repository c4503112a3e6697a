// Distance to the body.
#pragma once
#include "core/image.h"

namespace kvx {

// Distance in mm from every voxel to the nearest voxel centre of the body: 0 inside, infinite beyond
// `reach_mm` along an axis.
std::vector<float> DistanceToBodyMm(const Mask& body, double reach_mm);

}  // namespace kvx
