// How sure the registration is, voxel by voxel: in mm, and per cent.
#pragma once
#include <vector>

#include "core/image.h"
#include "core/registered_scan.h"
#include "pipeline/registration/images/level_images.h"
#include "pipeline/registration/images/shared_slopes.h"
#include "pipeline/registration/region/registration_inputs.h"
#include "pipeline/registration/region/work_region.h"

namespace kvx {

// What a registration leaves open, over its region.
struct LeftOpen {
  std::vector<float> variances_mm2;  // of soft tissue, as LevelOutcome gives them, for every 2 x 2 x 2 voxels
  Volume disagreement;               // as DisagreementAround gives it, for every 2 x 2 x 2 voxels
  Image<SharedSlopes> slopes;        // as SharedSlopesOfBlocks gives them
};

// How far off the place of a voxel may be, in steps of kPlaceErrorStepMm, on the template's grid: about two
// of three are not farther off than that, nineteen of twenty not farther than twice. Unknown outside the body
// and where the scan does not show the voxel (ScanShows). Soft tissue is as sure as images and prior make it,
// and less where the images show little, where they disagree, and between a CT and an MR; beside bone, and in
// it, what counts is how well the bone is known, and beside it how far tissue slips along it.
Mask PlaceErrorSteps(const RegistrationInputs& inputs, const LevelImages& images, const WorkRegion& region,
                     const LeftOpen& left_open, const std::vector<Eigen::Vector3f>& scan_mm);

// In mm; not a number where it is not known.
Volume PlaceErrorMm(const Mask& place_error_steps);

// How likely it is, in per cent, that a voxel's place is right to half a voxel of the grid; 0 where nothing
// is known.
Mask ConfidencePercent(const Mask& place_error_steps);
ConfidenceSummary Summarise(const Mask& place_error_steps, const Mask& body);

}  // namespace kvx
