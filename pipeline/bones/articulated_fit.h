// All bones of one scan together, at the scan's own voxels: bones are rigid and the tissue just around them
// moves by skinning (eq. 2), so that it helps to decide how a round bone is turned and does not mislead where
// a neighbour moves.
#pragma once
#include "core/pose.h"
#include "core/weight_map.h"
#include "pipeline/bones/cubic_image.h"

namespace kvx {

// A voxel of a bone or of its surroundings.
struct TissueSample {
  Eigen::Vector3d from_centre_mm;  // from the bone's centroid, in the template
  double value;                    // of the template
  Eigen::Vector3d gradient;        // of the template, per mm
  double away_mm;                  // from the bone; 0 in it
  double own_weight;               // skinning weight of the bone
  std::vector<std::pair<int, float>> others;
};

struct BoneTissue {
  PointMm centre;    // the bone's centroid, template
  double radius_mm;  // root mean square distance of its voxels from it
  double voxel_mm;
  Eigen::Matrix3d
      lever_mm2;  // how far, squared, a turn about each axis moves the surroundings: mean of |r|^2 - r r^T
  std::vector<TissueSample> samples;
};

// What the samples of every bone are; the template and weights are not needed afterwards.
std::vector<BoneTissue> SampleTissue(const BoneSet& bones, const CubicImage& template_image,
                                     const WeightMap& weights);

struct BoneEstimate {
  RigidTransform scan_from_template;
  Twist6Covariance covariance = Twist6Covariance::Zero();
  double correlation = 0;
};

// Gauss-Newton rounds over all bones from `start`.
// A bone that would move by more than `reach_mm[b]` keeps its start.
std::vector<BoneEstimate> FitArticulated(const std::vector<BoneTissue>& tissue, const CubicImage& scan,
                                         const PoseVector& start, const std::vector<double>& reach_mm);

}  // namespace kvx
