// Trilinear interpolation in double.
#include "kernels/added_displacement.h"

#include "core/voxels/to_corner.h"

namespace kvx {

Eigen::Vector3d AddedDisplacement::At(const Eigen::Vector3i& template_voxel) const {
  const Eigen::Vector3i last = size - Eigen::Vector3i::Ones();
  const Eigen::Vector3d at = (template_voxel - first)
                                 .cast<double>()
                                 .cwiseQuotient(step.cast<double>())
                                 .cwiseMin(last.cast<double>())
                                 .cwiseMax(0.0);
  const Eigen::Vector3i low = at.cast<int>();
  const Eigen::Vector3d above = at - low.cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i offset = ToCorner(corner), node = (low + offset).cwiseMin(last);
    double part = 1;
    for (int a = 0; a < 3; ++a) part *= offset[a] ? above[a] : 1 - above[a];
    sum += part * voxels[(size_t(node.z()) * size.y() + node.y()) * size.x() + node.x()].cast<double>();
  }
  return sum;
}

}  // namespace kvx
