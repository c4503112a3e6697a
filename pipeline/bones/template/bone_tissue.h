// The voxels of a bone and of the tissue just around it, as the template shows them: what a scan is compared
// with.
#pragma once
#include "core/bone.h"
#include "core/weight_map.h"
#include "pipeline/scans/cubic_image.h"

namespace kvx {

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
  Image<int32_t> sample_at;  // the sample of each voxel of a box around the bone; kNoSample elsewhere
};
constexpr int32_t kNoSample = -1;

// Of every bone; other bones are not part of its surroundings.
std::vector<BoneTissue> SampleTissue(const BoneSet& bones, const CubicImage& template_image,
                                     const WeightMap& weights);

}  // namespace kvx
