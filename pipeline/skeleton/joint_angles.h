// By how much a joint is turned about each of its axes.
#pragma once
#include <span>

#include "core/rigid_transform.h"

namespace kvx {

// Angles that bring the ordered product of rotations about `axes` closest to a rotation.
Eigen::VectorXd AnglesOf(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation);

}  // namespace kvx
