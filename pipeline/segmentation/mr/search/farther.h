// Ends of a bone that its strokes do not come near: a search that goes farther finds them, and much that is
// no bone; what of it has a surface like the bone's is kept.
#pragma once
#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

// The bone and those pieces beyond it of `farther`, found farther from the strokes, that end on dark cortex.
// `marrow_level`: intensity of marrow; `clear_rise`: the OutwardRise that a piece's surface must have, one of
// more than half the bone's voxels half as much again.
FoundBone WithEnds(const FoundBone& bone, const FoundBone& farther, const Volume& scan, double marrow_level,
                   double clear_rise);

}  // namespace kvx
