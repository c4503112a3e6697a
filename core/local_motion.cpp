// Composition about a centre.
#include "core/local_motion.h"

namespace kvx {

Twist LocalMotion(const RigidTransform& pose, const RigidTransform& other, const PointMm& centre) {
  const RigidTransform between = pose.Inverse() * other;
  Twist out;
  out << RotationVector(between.rotation), (between * centre).lps - centre.lps;
  return out;
}

RigidTransform MovedLocally(const RigidTransform& pose, const Twist& by, const PointMm& centre) {
  RigidTransform turn = RotationAbout(centre, by.head<3>(), by.head<3>().norm());
  turn.translation_mm += by.tail<3>();
  return pose * turn;
}

}  // namespace kvx
