// Sampling that goes on constant outside the grid.
#pragma once
#include "core/image.h"

namespace kvx {

// As SampleTrilinear(volume, p) within the grid; beyond it, as at the nearest place within.
inline float SampleClamped(const Volume& volume, const PointVox& p) {
  return SampleTrilinear(volume, volume.grid.Nearest(p));
}

}  // namespace kvx
