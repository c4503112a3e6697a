// The nearest marked voxel of every voxel, by distance in mm.
#pragma once
#include "core/image.h"

namespace kvx {

// Memory index of the nearest voxel of the mask; a marked voxel is its own. Exact for any spacing. The mask
// must not be empty.
std::vector<uint32_t> NearestMarked(const Mask& mask);

}  // namespace kvx
