// Only the grid moves.
#include "pipeline/bones/half_turned.h"

#include "core/moved_grid.h"

namespace kvx {

namespace {

PointMm MiddleOf(const Grid& grid) {
  return grid.ToMm(PointVox{0.5 * (grid.size.array() - 1).cast<double>().matrix()});
}

}  // namespace

HalfTurned TurnedByHalf(Volume scan, int axis) {
  const Grid& grid = scan.grid;
  const RigidTransform turn = RotationAbout(MiddleOf(grid), Eigen::Vector3d::Unit(axis), kPi);
  scan.grid = Moved(turn, grid);
  return {std::move(scan), turn};
}

}  // namespace kvx
