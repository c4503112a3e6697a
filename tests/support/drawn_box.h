// A box in a label map, turned against any grid.
#pragma once
#include "core/image.h"

namespace kvx::testing_support {

inline const Eigen::Matrix3d kAxes =
    Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
inline const Eigen::Vector3d kHalf(14, 6, 3.5);

inline LabelMap DrawnBox(const Grid& grid, const Eigen::Vector3d& centre_mm, int label, LabelMap map = {}) {
  if (map.values.empty()) map = LabelMap(grid);
  for (size_t v = 0; v < map.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps - centre_mm;
    if (((kAxes.transpose() * x).cwiseAbs().array() <= kHalf.array()).all()) map.values[v] = uint16_t(label);
  }
  return map;
}

inline Eigen::Vector3d MiddleOf(const Grid& grid) {
  return grid.ToMm(PointVox{0.5 * (grid.size.array() - 1).cast<double>().matrix()}).lps;
}

}  // namespace kvx::testing_support
