// The noise of a scan from the scan alone.
#pragma once
#include "core/image.h"

namespace kvx {

// Standard deviation of voxel noise where `use` (same grid; empty: voxels brighter than the volume's mean).
// Taken from the median of third differences over 2 x 2 x 2 voxels, which anatomy hardly touches.
// Never below 0.5 % of the intensities' spread.
double NoiseSigma(const Volume& volume, const Mask& use = {});

}  // namespace kvx
