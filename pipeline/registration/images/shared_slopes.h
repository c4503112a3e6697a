// What template and scan, once registered, both show of where tissue lies.
#pragma once
#include <span>

#include "core/image.h"
#include "kernels/block_level.h"

namespace kvx {

// Slopes of both images over the voxels of a place, in the template's frame, per mm and weighted as
// measurements are. What only one of the images has, noise above all, adds nothing to the products.
struct SharedSlopes {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();  // symmetric: (s t^T + t s^T) / 2
  Eigen::Vector3d of_template = Eigen::Vector3d::Zero(), of_scan = Eigen::Vector3d::Zero();
  double weight = 0;

  SharedSlopes& operator+=(const SharedSlopes& other);
  SharedSlopes& operator-=(const SharedSlopes& other);
  // 1/mm^2: the inverse covariance of the place, if all of it moved as one. A slope that is the same
  // everywhere, as shading makes it, tells nothing. Not positive along axes where the images show nothing in
  // common.
  Eigen::Matrix3d Information() const;
};

// Of every kBlockVoxels^3 voxels of the level that the scan shows and that count. `scan_mm`: where every
// voxel of the level lies.
Image<SharedSlopes> SharedSlopesOfBlocks(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm);

}  // namespace kvx
