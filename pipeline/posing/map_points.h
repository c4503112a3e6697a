// Eq. 6 at arbitrary template points, in double on the host: weights and displacements interpolated
// trilinearly.
#pragma once
#include "kernels/bricked_body.h"
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

// Points away from the body move with the nearest stored place.
class PointMapper {
 public:
  PointMapper(const BrickedBody& body, const Grid& template_grid);
  PointMm operator()(const ResolvedPose& pose, const PointMm& in_template) const;

 private:
  Eigen::Vector3d NearestStored(const Eigen::Vector3d& voxel) const;

  const BrickedBody& body_;
  const Grid grid_;
  std::vector<int32_t> nearest_;  // per brick of the dense table: a near brick with cells
};

}  // namespace kvx
