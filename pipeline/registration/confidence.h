// How sure the registration is, voxel by voxel.
#pragma once
#include "pipeline/registration/level_images.h"

namespace kvx {

// Per cent on the template's grid; 0 outside the body and where the scan does not show the voxel. Soft tissue
// is as sure as the images make it (`cells`: 0..1 for every 2 x 2 x 2 voxels of the region); beside bone, and
// in it, what counts is whether the bone was found.
Mask ConfidencePercent(const RegisterScan::Inputs& inputs, const Volume& beyond_coat_mm,
                       const WorkRegion& region, const std::vector<float>& cells,
                       const std::vector<Eigen::Vector3f>& scan_mm);

ConfidenceSummary Summarise(const Mask& confidence_percent, const Mask& body);

}  // namespace kvx
