// The noise of a scan from the scan alone.
#pragma once
#include "core/image.h"

namespace kvx {

// Standard deviation of voxel noise where `use` (same grid; empty: voxels brighter than the volume's mean),
// also where neighbours share some of it: scans that were interpolated, filled up with zeros or smoothed.
// Taken from the median of third differences over 2 x 2 x 2 voxels, which anatomy hardly touches, and from
// how much larger they are over two voxels along each axis. Never below 0.5 % of the intensities' spread.
double NoiseSigma(const Volume& volume, const Mask& use = {});

// How many voxels count as one measurement because they share their noise, at least 1: a scan interpolated to
// twice as many voxels along each axis has 2.8, half-way by factors between every voxel and the 8 that came
// of one, which is what registers best. By the axis along which fewest share: 1 where only some were
// interpolated, and 1 where there is hardly any noise, as smooth anatomy looks the same.
double VoxelsSharingNoise(const Volume& volume);

}  // namespace kvx
