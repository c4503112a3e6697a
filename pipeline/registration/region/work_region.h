// The box of template voxels that a registration works on.
#pragma once
#include "core/host/parallel.h"
#include "core/image.h"
#include "kernels/block_level.h"

namespace kvx {

// May stick out of the template.
struct WorkRegion {
  Eigen::Vector3i first = Eigen::Vector3i::Zero();  // template voxel of the box's voxel 0
  Grid grid;
};

// Around the body, with a block's width to spare; a multiple of so many voxels wide along every axis.
WorkRegion RegionAround(const Mask& body, int multiple = kBlockVoxels);

// Parts of the template on the region's grid; 0 outside the template.
template <class T>
Image<T> Crop(const Image<T>& image, const WorkRegion& region) {
  Image<T> out(region.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
    const Eigen::Vector3i p = region.grid.Ijk(v) + region.first;
    if (image.grid.Contains(p)) out.values[v] = image(p.x(), p.y(), p.z());
  });
  return out;
}

}  // namespace kvx
