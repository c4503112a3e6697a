// How sure the registration is, voxel by voxel: per cent, and in mm.
#pragma once
#include "pipeline/registration/block_solver.h"
#include "pipeline/registration/level_images.h"

namespace kvx {

constexpr double kPlaceErrorStepMm = 0.05;
constexpr uint8_t kPlaceErrorUnknown = 255;  // or more than the steps can say

// On the template's grid.
struct SurenessMaps {
  // Per cent; 0 outside the body and where the scan does not show the voxel. Soft tissue is as sure as the
  // images make it; beside bone, and in it, what counts is whether the bone was found.
  Mask confidence_percent;
  // How far off the place of a voxel may be, in steps of kPlaceErrorStepMm: about two of three are not
  // farther off than that, nineteen of twenty not farther than twice. Unknown outside the body, where the
  // scan does not show the voxel, and where its bone is in doubt.
  Mask place_error_steps;
};

// `cells`: what the images say, for every 2 x 2 x 2 voxels of the region.
SurenessMaps Sureness(const RegisterScan::Inputs& inputs, const Volume& beyond_coat_mm,
                      const WorkRegion& region, const std::vector<PlaceCertainty>& cells,
                      const std::vector<Eigen::Vector3f>& scan_mm);

// In mm; not a number where it is not known.
Volume PlaceErrorMm(const Mask& place_error_steps);

ConfidenceSummary Summarise(const Mask& confidence_percent, const Mask& body);

}  // namespace kvx
