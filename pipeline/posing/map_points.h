// Eq. 6 at arbitrary template points, in double on the host: weights and displacements interpolated
// trilinearly, and bones rigid up to their borders.
#pragma once
#include "kernels/bricked_body.h"
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

// A voxel of a bone is bone up to its faces: where the nodes of a bone have half of the trilinear share or
// more a point moves as that bone does. From there to no share its motion fades into that of the other nodes.
// Points away from the body move with the nearest stored place.
class PointMapper {
 public:
  PointMapper(const BrickedBody& body, const Grid& template_grid);
  PointMm operator()(const ResolvedPose& pose, const PointMm& in_template) const;

 private:
  static constexpr int kNoBone = -1;
  struct Place {
    int brick;  // with cells
    Eigen::Vector3d voxel;
  };
  struct Corner {
    double share;  // trilinear
    int brick, slot;
    VoxelWeights weights;
    int bone;  // that the node is in, or kNoBone
  };
  using Corners = std::vector<Corner>;
  static double ShareOf(const Corners& corners);
  // Those in the bone of the greatest share; may be empty.
  static Corners TakePrevailingBone(Corners& corners);
  Place NearestStored(const Eigen::Vector3d& voxel) const;
  Corners CornersAround(const Place& place) const;
  // By the weighted mean of the corners' motions.
  PointMm Moved(const Corners& corners, const ResolvedPose& pose, const PointMm& in_template) const;

  const BrickedBody& body_;
  const Grid grid_;
  std::vector<int32_t> nearest_;  // per brick of the dense table: a near brick with cells
};

}  // namespace kvx
