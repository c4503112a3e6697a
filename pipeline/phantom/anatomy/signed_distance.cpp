// Distances in closed form; unions by a cubic smooth minimum.
#include "pipeline/phantom/anatomy/signed_distance.h"

#include <algorithm>
#include <cmath>

namespace kvx::phantom {

double Distance(const RoundCone& cone, const Eigen::Vector3d& x) {
  // In the half plane through the axis: (along, off). The slanted side touches both balls; beyond it a ball
  // is nearest.
  const Eigen::Vector3d axis = cone.b - cone.a;
  const double length = axis.norm(), drop = cone.radius_a_mm - cone.radius_b_mm;
  if (length <= std::abs(drop)) {  // one ball holds the other
    return std::min((x - cone.a).norm() - cone.radius_a_mm, (x - cone.b).norm() - cone.radius_b_mm);
  }
  const double along = (x - cone.a).dot(axis) / length;
  const double off = std::sqrt(std::max(0.0, (x - cone.a).squaredNorm() - along * along));
  const double sine = drop / length, cosine = std::sqrt(1.0 - sine * sine);
  const double foot = along * cosine - off * sine;  // position along the slanted side, from the ball at a
  if (foot <= 0) return std::hypot(along, off) - cone.radius_a_mm;
  if (foot >= length * cosine) return std::hypot(along - length, off) - cone.radius_b_mm;
  return along * sine + off * cosine - cone.radius_a_mm;
}

double Distance(const Ellipsoid& ellipsoid, const Eigen::Vector3d& x) {
  const Eigen::Vector3d p = x - ellipsoid.centre;
  const double level = p.cwiseQuotient(ellipsoid.radii_mm).norm();
  const double slope = p.cwiseQuotient(ellipsoid.radii_mm.cwiseAbs2()).norm();
  if (slope < 1e-12) return -ellipsoid.radii_mm.minCoeff();
  return level * (level - 1.0) / slope;
}

double SmoothMin(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0);
  if (h <= 0) return std::min(a, b);
  return std::min(a, b) - h * h * h / (6.0 * blend * blend);
}

double Shape::Distance(const Eigen::Vector3d& x) const {
  double d = 1e6;
  for (const RoundCone& cone : cones) d = SmoothMin(d, phantom::Distance(cone, x), blend_mm);
  for (const Ellipsoid& ellipsoid : ellipsoids) d = SmoothMin(d, phantom::Distance(ellipsoid, x), blend_mm);
  return std::max(d, std::max((cut_low - x).maxCoeff(), (x - cut_high).maxCoeff()));
}

Box Shape::Bounds() const {
  Box box;
  for (const RoundCone& cone : cones) {
    box.Add(cone.a, Eigen::Vector3d::Constant(cone.radius_a_mm));
    box.Add(cone.b, Eigen::Vector3d::Constant(cone.radius_b_mm));
  }
  for (const Ellipsoid& ellipsoid : ellipsoids) box.Add(ellipsoid.centre, ellipsoid.radii_mm);
  box = box.Grown(blend_mm / 6.0);
  return {box.low.cwiseMax(cut_low), box.high.cwiseMin(cut_high)};
}

}  // namespace kvx::phantom
