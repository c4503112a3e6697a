// Gaussian smoothing of a volume.
#pragma once
#include "core/image.h"

namespace kvx {

// Axis by axis, cut at three standard deviations; beyond the border its value goes on. The deviation is in
// voxels of each axis; an axis with 0 stays as it is.
void GaussianBlur(Volume& volume, const Eigen::Vector3d& deviation_vox);

}  // namespace kvx
