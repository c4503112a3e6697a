// Masks a voxel larger or smaller.
#pragma once
#include "core/image.h"

namespace kvx {

// With all of the six neighbours of its voxels.
Mask Dilated(const Mask& mask);
// Without voxels that have one of their six neighbours outside the mask. What lies outside the grid does not
// count.
Mask Eroded(const Mask& mask);

}  // namespace kvx
