// MR: the dark layer of cortical bone around the marrow that was found.
#pragma once
#include "pipeline/segmentation/mr/search/stroke_bone.h"

namespace kvx {

// Marrow, the bone's strokes, and the cortex around them, on the grid of the bone's box. Its outer border
// lies where ways outwards get bright again; where they do not (tendons), the layer is as thick as elsewhere
// on this bone.
Mask WithCortex(const StrokeBone& bone, const TissueCounts& tissues);

}  // namespace kvx
