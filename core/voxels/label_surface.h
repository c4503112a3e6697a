// The surface of a label map's parts.
#pragma once
#include "core/image.h"

namespace kvx {

// Whether a voxel is beside one of another label, or at the border of the grid.
template <class Label>
bool AtSurface(const Image<Label>& labels, const Eigen::Vector3i& at) {
  const Label label = labels(at.x(), at.y(), at.z());
  for (int a = 0; a < 3; ++a) {
    for (const int step : {-1, 1}) {
      const Eigen::Vector3i beside = at + step * Eigen::Vector3i::Unit(a);
      if (!labels.grid.Contains(beside) || labels(beside.x(), beside.y(), beside.z()) != label) return true;
    }
  }
  return false;
}

}  // namespace kvx
