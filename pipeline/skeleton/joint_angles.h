// By how much a joint is turned about each of its axes.
#pragma once
#include <span>

#include "core/rigid_transform.h"

namespace kvx {

// Angles that bring the ordered product of rotations about up to three axes closest to a rotation, each
// within half a turn either way. Three axes at right angles bring it there exactly, in one of two ways: that
// with the second angle within a right angle.
Eigen::VectorXd AnglesOf(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation);

}  // namespace kvx
