// A grid carried by a rigid motion: the same voxels, elsewhere in the world.
#pragma once
#include "core/grid.h"
#include "core/rigid_transform.h"

namespace kvx {

inline Grid Moved(const RigidTransform& b_from_a, Grid in_a) {
  in_a.origin = b_from_a * in_a.origin;
  in_a.direction = b_from_a.rotation.toRotationMatrix() * in_a.direction;
  return in_a;
}

}  // namespace kvx
