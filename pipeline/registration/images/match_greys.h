// What template and scan show is brought to the same contrast, shading, mean and noise.
#pragma once
#include "pipeline/registration/images/shown_pair.h"

namespace kvx {

// Fills the intensities of the level and its scan, from what both show (`shown`) where level.start puts the
// voxels that count (level.weight).
void MatchGreys(const RegistrationInputs& inputs, const LevelImages& images, ShownPair shown,
                BlockLevel& level);

}  // namespace kvx
