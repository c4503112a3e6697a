// Only the grid moves.
#include "pipeline/bones/images/half_turned.h"

#include "core/voxels/moved_grid.h"

namespace kvx {

HalfTurned TurnedByHalf(Volume scan, int axis) {
  const Grid& grid = scan.grid;
  const RigidTransform turn = RotationAbout(grid.Middle(), Eigen::Vector3d::Unit(axis), kPi);
  scan.grid = Moved(turn, grid);
  return {std::move(scan), turn};
}

}  // namespace kvx
