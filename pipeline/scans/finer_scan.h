// A scan of wide voxels or thick slices, between its voxels.
#pragma once
#include "core/image.h"

namespace kvx {

// On FinerGrid(scan.grid, times), on an interpolating cubic spline. The scan as it is where all of `times`
// are 1.
Volume Finer(const Volume& scan, const Eigen::Vector3i& times);

// Along axes whose voxels are wider than `spacing_mm` by half and more: so many voxels in the place of one
// that they are nearly that wide. The border stays where it is. Without such axes the scan as it is.
Volume AsFineAs(const Volume& scan, double spacing_mm);

}  // namespace kvx
