// A scan at coarser and coarser voxels, centred and scaled so that sums in single precision are safe.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

// Values minus their mean, over their standard deviation; what is not a number becomes the mean.
Volume Normalised(Volume volume);
// Block means with voxels of about `voxel_mm` along every axis: an axis that is coarse already stays as it
// is.
Volume CoarsenedTo(const Volume& volume, double voxel_mm);
// Back again: linear between the voxels of `volume` and constant beyond them, on a finer grid of the same
// axes.
Volume OnFinerGrid(Volume volume, const Grid& finer);
// Level 0 is the normalised volume itself, then one level for each of `voxel_mm`.
std::vector<Volume> MakeLevels(const Volume& volume, const std::vector<double>& voxel_mm);

}  // namespace kvx
