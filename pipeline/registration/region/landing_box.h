// The part of a scan that a registration looks at.
#pragma once
#include "core/voxels/voxel_box.h"
#include "pipeline/registration/region/registration_inputs.h"

namespace kvx {

// Of `grid`, which lies in the scan's frame: where skinning (eq. 2) puts the body, and kLandingSpareMm to
// every side; the part nearest to it where that is beyond the grid.
VoxelBox LandingBox(const RegistrationInputs& inputs, const Grid& grid);

constexpr double kLandingSpareMm = 40;  // starts may be that far off, and blocks look beyond the skin

}  // namespace kvx
