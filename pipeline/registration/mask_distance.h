// Exact Euclidean distance (mm) of every voxel to the nearest voxel of a set.
#pragma once
#include "core/image.h"

namespace kvx {

// Between voxel centres; 0 in the set, a very large value everywhere when the set is empty.
Volume DistanceMm(const Mask& set);

}  // namespace kvx
