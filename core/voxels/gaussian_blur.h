// Gaussian and other symmetric smoothing of a volume, axis by axis.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

// Along one axis; `half_kernel`: the centre's weight, then those of one side. Beyond the border its value
// goes on.
void BlurAlong(Volume& volume, int axis, const std::vector<float>& half_kernel);

// (1 2 1) / 4 along each axis, `times` times: nearly a Gaussian of sqrt(times / 2) voxels.
void BinomialBlur(Volume& volume, int times);

// Cut at three standard deviations. The deviation is in
// voxels of each axis; an axis with 0 stays as it is.
void GaussianBlur(Volume& volume, const Eigen::Vector3d& deviation_vox);

}  // namespace kvx
