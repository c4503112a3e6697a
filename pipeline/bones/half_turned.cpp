// Only the grid moves.
#include "pipeline/bones/half_turned.h"

namespace kvx {

HalfTurned TurnedByHalf(Volume scan, int axis) {
  Grid& grid = scan.grid;
  const PointMm middle = grid.ToMm(PointVox{0.5 * (grid.size.array() - 1).cast<double>().matrix()});
  const RigidTransform turn = RotationAbout(middle, Eigen::Vector3d::Unit(axis), kPi);
  grid.origin = turn * grid.origin;
  grid.direction = turn.rotation.toRotationMatrix() * grid.direction;
  return {std::move(scan), turn};
}

}  // namespace kvx
