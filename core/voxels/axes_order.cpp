// Of three axes and three ways the nearest pair is joined first, then the nearest of those left.
#include "core/voxels/axes_order.h"

namespace kvx {

Grid RightFrontUp(const Grid& grid) {
  const Eigen::Vector3d ways(-1, -1, 1);  // in LPS
  Grid out = grid;
  Eigen::Matrix3d nearness = grid.direction.cwiseAbs();
  for (int n = 0; n < 3; ++n) {
    int to = 0, from = 0;
    nearness.maxCoeff(&to, &from);
    nearness.row(to).setConstant(-1), nearness.col(from).setConstant(-1);
    out.size[to] = grid.size[from];
    out.spacing_mm[to] = grid.spacing_mm[from];
    out.direction.col(to) = grid.direction.col(from);
    if (grid.direction(to, from) * ways[to] > 0) continue;
    out.direction.col(to) *= -1;
    out.origin.lps += (grid.size[from] - 1) * grid.spacing_mm[from] * grid.direction.col(from);
  }
  return out;
}

StoredSteps StepsIn(const Grid& stored, const Grid& grid) {
  const Eigen::Matrix3d axes = stored.direction.transpose() * grid.direction;
  const Eigen::Vector3d first = stored.ToVox(grid.origin).ijk;
  const auto offset = [&](const Eigen::Vector3d& ijk) {
    const auto at = [&](int axis) { return int64_t(std::lround(ijk[axis])); };
    return (at(2) * stored.size.y() + at(1)) * stored.size.x() + at(0);
  };
  return {offset(first), offset(axes.col(0)), offset(axes.col(1)), offset(axes.col(2))};
}

}  // namespace kvx
