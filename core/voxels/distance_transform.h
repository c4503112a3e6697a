// Exact Euclidean distances from a set of voxels, in millimetres, on anisotropic grids.
#pragma once
#include "core/image.h"

namespace kvx {

constexpr double kNoVoxelInSight = 1e12;  // squared mm, everywhere when the set is empty

constexpr double kAnyReach = 1e6;  // mm

// Squared mm from every voxel centre to the nearest voxel of the set (Felzenszwalb and Huttenlocher 2012).
// What lies farther than `reach_mm` need not be told: there are values beyond it, of whatever size.
Image<double> SquaredDistanceMm(const Mask& set, double reach_mm = kAnyReach);

// In mm, and in half the memory.
Volume DistanceMapMm(const Mask& set, double reach_mm = kAnyReach);

}  // namespace kvx
