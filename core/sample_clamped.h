// Sampling that goes on constant outside the grid.
#pragma once
#include "core/image.h"

namespace kvx {

// As SampleTrilinear(volume, p) within the grid; beyond it, as at the nearest place within.
inline float SampleClamped(const Volume& volume, const PointVox& p) {
  const Eigen::Vector3d last = volume.grid.size.cast<double>().array() - 1;
  return SampleTrilinear(volume, PointVox{p.ijk.cwiseMax(0.0).cwiseMin(last)});
}

}  // namespace kvx
