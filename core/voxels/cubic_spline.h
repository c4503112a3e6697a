// Interpolating cubic B-splines: Unser, Splines: a perfect fit for signal and image processing (1999).
// Mirrored at the centres of the outermost voxels.
#pragma once
#include "core/image.h"

namespace kvx {

// The voxel that stands for one beyond the outermost.
int MirroredVoxel(int at, int size);

// On the image's grid: of the spline that takes the image's values at its voxels.
Volume SplineCoefficients(Volume image);

// Along one axis of `size` voxels: the four coefficients that make the value and the slope per voxel at `p`,
// which lies within the voxels' centres.
struct SplineTaps {
  SplineTaps(double p, int size);
  int at[4];
  double weight[4], slope[4];
};

// What the spline of these coefficients takes at `p`, in voxels; `outside` beyond the hull of voxel centres.
float SampleSpline(const Volume& coefficients, const PointVox& p, float outside = 0.0f);

}  // namespace kvx
