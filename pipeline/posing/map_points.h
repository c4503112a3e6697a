// Eq. 6 at arbitrary template points, in double on the host: weights and displacements interpolated
// trilinearly, and bones rigid up to their borders.
#pragma once
#include <span>
#include <vector>

#include "kernels/added_displacement.h"
#include "kernels/bricked_body.h"
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

// Beside bones as core/bone_border.h has it. Points away from the body move with the nearest stored place.
class PointMapper {
 public:
  PointMapper(const BrickedBody& body, const Grid& template_grid);
  // `added`: to the examples' displacements at every voxel but those of bones, if any.
  PointMm operator()(const ResolvedPose& pose, const PointMm& in_template,
                     const AddedDisplacement* added = nullptr) const;

 private:
  struct Place {
    int brick;  // with cells
    Eigen::Vector3d voxel;
  };
  struct Corner {
    double part;  // trilinear weight
    int brick, slot;
    VoxelWeights weights;
    int bone;               // that the node is in, or kNoBone
    Eigen::Vector3d added;  // template voxels
  };
  Place NearestStored(const Eigen::Vector3d& voxel) const;
  std::vector<Corner> CornersAround(const Place& place, const AddedDisplacement* added) const;
  // By the weighted mean of the corners' motions.
  PointMm Moved(std::span<const Corner> corners, const ResolvedPose& pose, const PointMm& in_template) const;

  const BrickedBody& body_;
  const Grid grid_;
  std::vector<int32_t> nearest_;  // per brick of the dense table: a near brick with cells
};

}  // namespace kvx
