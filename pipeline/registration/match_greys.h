// What template and scan show is brought to the same contrast, shading, mean and noise.
#pragma once
#include "pipeline/registration/level_images.h"

namespace kvx {

// Fills the intensities of the level and its scan, from what both show where level.start puts the voxels that
// count (level.weight).
void MatchGreys(const RegisterScan::Inputs& inputs, const LevelImages& images, BlockLevel& level);

}  // namespace kvx
