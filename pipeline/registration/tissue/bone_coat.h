// What grows on bones and goes with them: cartilage and the like.
#pragma once
#include "pipeline/registration/region/work_region.h"

namespace kvx {

// Per voxel of the region, how far it lies beyond the coat of the bone nearest to it: minus the coat's
// thickness at a bone's surface and in bones, negative within the coat. Very far where there is no bone. A
// coat is as thick as its bone is: about 1.5 mm on a thigh bone, 0.3 mm on a finger's.
Volume BeyondBoneCoatMm(const LabelMap& bone_labels, const WorkRegion& region);

}  // namespace kvx
