// A scan as if it had been taken from the other side: a palm up instead of down, a leg from the feet instead
// of the head.
#pragma once
#include "core/image.h"
#include "core/rigid_transform.h"

namespace kvx {

struct HalfTurned {
  Volume scan;  // the same voxels, elsewhere in the world
  RigidTransform turned_from_scan;
};
// Its world turned by half about this axis of the world, through the middle of the scan.
HalfTurned TurnedByHalf(Volume scan, int axis);

}  // namespace kvx
