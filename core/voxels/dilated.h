// Masks made larger or smaller: by a voxel, or by a distance.
#pragma once
#include "core/image.h"

namespace kvx {

// With all of the six neighbours of its voxels.
Mask Dilated(const Mask& mask);
// Without voxels that have one of their six neighbours outside the mask. What lies outside the grid does not
// count.
Mask Eroded(const Mask& mask);

// With every voxel whose centre is at most `radius_mm` from that of one of the mask's (Euclidean, exact).
Mask Dilated(const Mask& mask, double radius_mm);
// Without every voxel whose centre is at most `radius_mm` from that of one the mask leaves out. What lies
// outside the grid does not count.
Mask Eroded(const Mask& mask, double radius_mm);

}  // namespace kvx
