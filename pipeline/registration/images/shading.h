// The slow change of brightness across a scan that its coils make, beside that of the template.
#pragma once
#include <optional>
#include <span>

#include "core/image.h"

namespace kvx {

// exp of a quadratic polynomial in a box.
struct Shading {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero(), half_mm = Eigen::Vector3d::Ones();
  Eigen::Matrix<double, 10, 1> coefficients = Eigen::Matrix<double, 10, 1>::Zero();
  double At(const Eigen::Vector3d& x_mm) const;  // beyond the box as at its border
  Volume On(const Grid& grid) const;
};

struct ShadingSample {
  Eigen::Vector3d x_mm;
  double template_value = 0, scan_value = 0;  // at the same tissue, as far as the start knows
};

// scan = template * shading, robustly: what the start misplaces loses its weight. Dark samples do not count;
// nothing where too few are left.
std::optional<Shading> FitShading(std::span<const ShadingSample> samples);

}  // namespace kvx
