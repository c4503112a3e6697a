// What lies around a limb and is as bright as it: the scanner's table, splints, casts, pads.
#pragma once
#include "core/bone.h"
#include "core/image.h"

namespace kvx {

// The body without what holds no bone and is a plate, a shell or a strand: less than 16 mm thick where a
// piece hangs on the limb by less than 5 mm (or two voxels), less than that where it rests on it. Thick
// pieces without a bone stay (the other leg). All of the body where no bone has voxels.
Mask WithoutSurroundings(const Mask& body, const BoneSet& bones);

}  // namespace kvx
