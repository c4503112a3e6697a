// Whether a threshold's parts are bones or accidents of its level.
#pragma once
#include "core/image.h"

namespace kvx {

// How much of the parts of a scan by a threshold is left when the level that parts them (BoneLevels) moves a
// little, of the higher and the lower one the better, or when half the seam is enough to join two
// (JoinedParts), whichever leaves less: as the mean Dice of each part with the one most like it there,
// weighted by size. About 0.95 where bones are apart.
double KeptOtherwise(const Volume& scan_hu, double parting_hu);

}  // namespace kvx
