// What a scan shows beside the limb and is as bright as it: the other leg, the scanner's table, casts, pads.
#pragma once
#include "core/bone.h"
#include "core/image.h"

namespace kvx {

// The body without what holds no bone and is a plate, a shell or a strand: less than 16 mm thick where a
// piece hangs on the limb by less than 5 mm (or two voxels), less than that where it rests on it. Thick
// pieces without a bone stay (the other leg). All of the body where no bone has voxels.
Mask WithoutSurroundings(const Mask& body, const BoneSet& bones);

// The body without the pieces that hold no bone and are more than a twentieth of those that do. Smaller ones
// stay (a marker on the skin), and all of it where no piece holds bones.
Mask WithoutOtherLimbs(const Mask& body, const BoneSet& bones);

}  // namespace kvx
