// Planes at the sides, counted and repeated.
#include "pipeline/skinning/continued_roles.h"

#include <algorithm>
#include <cmath>

#include "core/frames.h"
#include "core/host/parallel.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

// Of the diameter of a disc as large as the cut. What a side does fades within about that, as far as bones
// are not nearer to each other
constexpr double kReach = 0.5;

// Planes to repeat beyond a side across an axis.
int Beyond(const RoleMap& roles, int axis, bool at_end) {
  VoxelBox side{Eigen::Vector3i::Zero(), roles.grid.size};
  (at_end ? side.low[axis] : side.high[axis]) = at_end ? roles.grid.size[axis] - 1 : 1;
  size_t body = 0;
  ForEachVoxel(side, roles.grid, [&](const auto&, size_t, size_t v) { body += roles.values[v] != kOutside; });
  const Eigen::Vector3d& spacing_mm = roles.grid.spacing_mm;
  const double area_mm2 = double(body) * spacing_mm.prod() / spacing_mm[axis];
  return int(std::ceil(kReach * 2 * std::sqrt(area_mm2 / kPi) / spacing_mm[axis]));
}

double TimesTheVoxels(const Grid& grid, const Eigen::Vector3i& before, const Eigen::Vector3i& after) {
  return ((grid.size + before + after).cast<double>().array() / grid.size.cast<double>().array()).prod();
}

}  // namespace

ContinuedRoles Continued(const RoleMap& roles) {
  Eigen::Vector3i before, after;
  for (int a = 0; a < 3; ++a) before[a] = Beyond(roles, a, false), after[a] = Beyond(roles, a, true);
  while (TimesTheVoxels(roles.grid, before, after) > kMostContinued) {
    before = before * 3 / 4;
    after = after * 3 / 4;
  }
  Grid grid = roles.grid;
  grid.size += before + after;
  grid.origin = roles.grid.ToMm(PointVox{-before.cast<double>()});
  ContinuedRoles out{RoleMap(grid), before};
  ParallelEach(out.roles.values.size(), [&](size_t v) {
    const Eigen::Vector3i p = roles.grid.Nearest(grid.Ijk(v) - before);
    out.roles.values[v] = roles(p.x(), p.y(), p.z());
  });
  return out;
}

}  // namespace kvx
