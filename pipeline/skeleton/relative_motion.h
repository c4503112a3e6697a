// How one bone moves relative to another, all in template world.
#pragma once
#include "core/pose.h"

namespace kvx {

// parent_template^-1 * child of one scan, and how far it is to be trusted (0..1).
struct RelativeMotion {
  RigidTransform motion;
  double weight = 1;
  // Covariance of how `motion` turns, as a small turn applied before it (rad^2). Zero: nothing is known of
  // it.
  Eigen::Matrix3d turn_spread = Eigen::Matrix3d::Zero();
  double play_rad = RadFromDeg(1);  // how far the joint itself strays from its axes, per direction
};
RelativeMotion MotionOf(const BoneFit& parent, const BoneFit& child, double weight);

}  // namespace kvx
