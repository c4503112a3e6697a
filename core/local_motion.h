// Small motions of a bone about its own centre, in the template's frame: (rotation vector in rad, shift in
// mm).
#pragma once
#include "core/rigid_transform.h"

namespace kvx {

// What takes `pose` to `other`, both scan from template: pose^-1 other as a turn about the centre and a shift
// of it.
Twist LocalMotion(const RigidTransform& pose, const RigidTransform& other, const PointMm& centre);

// The other way: x -> pose (centre + R (x - centre) + shift).
RigidTransform MovedLocally(const RigidTransform& pose, const Twist& by, const PointMm& centre);

}  // namespace kvx
