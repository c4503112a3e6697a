// A long bone that turns about its length by a fourteenth of what it bends, as a tibia does.
#pragma once
#include <cmath>

#include "core/rigid_transform.h"

namespace kvx::testing_support {

inline const Eigen::Vector3d kConjunctLength = Eigen::Vector3d::UnitX();
inline const Eigen::Vector3d kConjunctHinge(std::sin(RadFromDeg(2)), 0, std::cos(RadFromDeg(2)));

inline RigidTransform ConjunctBend(double bend_deg, double aside_deg = 0) {
  constexpr double kPart = 0.07;
  const Eigen::Vector3d aside = kConjunctHinge.cross(kConjunctLength).normalized();
  RigidTransform motion;
  motion.rotation = Eigen::AngleAxisd(RadFromDeg(bend_deg), kConjunctHinge) *
                    Eigen::AngleAxisd(RadFromDeg(aside_deg), aside) *
                    Eigen::AngleAxisd(RadFromDeg(kPart * bend_deg), kConjunctLength);
  return motion;
}

}  // namespace kvx::testing_support
