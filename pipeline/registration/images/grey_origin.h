// Greys of MR begin at 0, where a scanner's do: how bright a coil makes tissue is a ratio, and greys that a
// program shifted have none.
#pragma once
#include <string>

#include "core/image.h"

namespace kvx {

// What to take off: the darkest grey that was measured, 0 for CT and where greys begin near 0. `filled`:
// voxels that a program filled up, or no voxels. `modality` as Scan has it.
float GreyOriginOf(const Volume& measured, const Mask& filled, const std::string& modality);

Volume FromOrigin(Volume volume, float origin);

}  // namespace kvx
