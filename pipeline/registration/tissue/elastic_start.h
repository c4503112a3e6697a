// Where the registration starts: VBD (eq. 2), relaxed as elastic tissue between the bones.
#pragma once
#include "core/pose.h"
#include "core/weight_map.h"
#include "pipeline/registration/tissue/elastic_tissue.h"

namespace kvx {

// Scan mm of every voxel of the region. In bones it is exactly where the bones carry it; air
// goes with the tissue nearest to it. Linear blending loses volume and folds where joints bend strongly;
// tissue does neither.
std::vector<Eigen::Vector3f> ElasticStart(const WeightMap& weights, const ElasticTissue& tissue,
                                          const PoseVector& scan_from_template, const WorkRegion& region,
                                          const Progress& progress);

}  // namespace kvx
