// What the posing engine finds out about a template once.
#pragma once
#include <cmath>

#include "core/image.h"
#include "kernels/bricked_body.h"

namespace kvx {

// Voxels; low above high where there is nothing.
struct VoxelExtent {
  Eigen::Vector3d lo = Eigen::Vector3d::Constant(INFINITY), hi = Eigen::Vector3d::Constant(-INFINITY);
};

VoxelExtent BodyBox(const BrickedBody& body);
int64_t ClosedCells(const BrickedBody& body);  // unit cells all of whose corners are body
// Median of a sample of the voxels outside the body; the least value where there is nothing outside.
float AirOf(const Volume& volume, const BrickedBody& body);

}  // namespace kvx
