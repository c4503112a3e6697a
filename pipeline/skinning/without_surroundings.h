// What a scan shows beside the limb and is as bright as it: the other leg, the scanner's table, casts, pads.
#pragma once
#include "core/bone.h"
#include "core/image.h"

namespace kvx {

// The body without plates, shells and strands around the limb. The limb is what hangs together with bones
// 2.5 mm (or a voxel) below the surface, and the body within reach of that. Of what else there is at that
// depth, only pieces stay that reach 8 mm deep (`WithoutOtherLimbs`). All of the body where no bone has
// voxels.
Mask WithoutSurroundings(const Mask& body, const BoneSet& bones);

// The body without the pieces that hold no bone and are more than a twentieth of those that do. Smaller ones
// stay (a marker on the skin), and all of it where no piece holds bones.
Mask WithoutOtherLimbs(const Mask& body, const BoneSet& bones);

}  // namespace kvx
