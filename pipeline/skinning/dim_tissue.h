// Tissue far from the coil, as dim as noise, between tissue that is bright enough to be seen.
#pragma once
#include "core/image.h"
#include "pipeline/scans/air_level.h"

namespace kvx {

// The body with the pieces beside it that on average are brighter than air and that it encloses but for a
// fifth of their surface, where the view cuts no more of a piece than 0.7 of what faces the body. Gaps of up
// to four voxels stay open. `smooth`: the scan, lightly smoothed, on the body's grid.
Mask WithDimTissue(const Volume& smooth, const Mask& body, const AirLevel& level);

}  // namespace kvx
