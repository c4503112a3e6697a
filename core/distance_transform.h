// Exact Euclidean distances from a set of voxels, in millimetres, on anisotropic grids.
#pragma once
#include "core/image.h"

namespace kvx {

constexpr double kNoVoxelInSight = 1e12;  // squared mm, everywhere when the set is empty

// Squared mm from every voxel centre to the nearest voxel of the set (Felzenszwalb and Huttenlocher 2012).
Image<double> SquaredDistanceMm(const Mask& set);

// In mm, and in half the memory.
Volume DistanceMapMm(const Mask& set);

}  // namespace kvx
