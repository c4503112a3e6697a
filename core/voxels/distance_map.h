// Signed distance to the surface of a label, as of a bone.
#pragma once
#include "core/image.h"

namespace kvx {

// On the part of the label map's grid within `margin_mm` of the bone: mm to the surface, negative inside,
// exact between voxel centres (squared Euclidean distance transform, one axis after the other).
Volume SignedDistance(const LabelMap& labels, int label, double margin_mm);

}  // namespace kvx
