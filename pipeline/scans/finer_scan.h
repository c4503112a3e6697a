// A scan on voxels finer or coarser than its own.
#pragma once
#include "core/host/own_or_lent.h"
#include "core/image.h"

namespace kvx {

// On FinerGrid(scan.grid, times), on an interpolating cubic spline. The scan as it is where all of `times`
// are 1.
OwnOrLent<Volume> Finer(const Volume& scan, const Eigen::Vector3i& times);

// Along axes whose voxels are wider than `spacing_mm` by half and more: so many voxels in the place of one
// that they are nearly that wide. The border stays where it is. Without such axes the scan as it is.
Volume AsFineAs(Volume scan, double spacing_mm);

// Means over so many voxels that they are nearly `spacing_mm` wide, along axes whose voxels are two thirds of
// it or less; at least two are left. Without such axes the scan as it is.
Volume AsCoarseAs(const Volume& scan, double spacing_mm);

}  // namespace kvx
