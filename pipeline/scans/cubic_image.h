// An image between its voxels: interpolating cubic B-splines (Unser),
// value and gradient, mirrored at the border.
#pragma once
#include "core/image.h"

namespace kvx {

class CubicImage {
 public:
  explicit CubicImage(Volume volume);

  // Value and gradient per voxel at a voxel position. False outside the hull of voxel centres.
  bool At(const Eigen::Vector3d& p_in_voxels, double& value, Eigen::Vector3d& gradient) const;
  // How far off the value may be between thick slices, squared: what changes from one slice to the next, the
  // spline cannot know. 0 where voxels are nearly cubes.
  double MissedVariance(const Eigen::Vector3d& p_in_voxels) const;
  const Grid& grid() const { return coefficients_.grid; }

 private:
  Volume missed_variance_, coefficients_;
};

}  // namespace kvx
