// Robust least squares: how far residuals usually stray, and how much to trust one that strays farther.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <vector>

#include "core/numbers/quantile.h"

namespace kvx {

// Standard deviation of residuals of these absolute values if they were noise alone: by their median, so that
// less than half of them may be anything. `sizes`: not empty; reordered.
template <class Real>
Real UsualResidual(std::vector<Real>& sizes) {
  return Real(kSdOfMad) * TakeMedian(sizes) + Real(1e-6);
}

// Residuals of so many standard deviations are trusted a quarter.
constexpr double kTolerance = 2.0;

// Geman and McClure's weight of a residual, its square given in that of the residual at which trust has
// fallen to a quarter.
template <class Real>
Real TrustAt(Real squared) {
  return 1 / ((1 + squared) * (1 + squared));
}

// Residuals so near each other may have one cause: the cell of a place, about a finger bone's thickness wide.
inline std::array<int, 3> ClusterOf(const Eigen::Vector3d& place_mm, double voxel_mm) {
  constexpr double kClusterMm = 10.0;
  const Eigen::Vector3d cell = (place_mm / std::max(kClusterMm, 2 * voxel_mm)).array().floor();
  return {int(cell.x()), int(cell.y()), int(cell.z())};
}

}  // namespace kvx
