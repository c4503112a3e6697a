// Oriented bounding boxes of bones (paper, section 3.1).
#pragma once
#include "core/bone.h"

namespace kvx {

// Box of the voxels `label` of a label map; `towards_parent` (template world) decides which end is the base.
OrientedBox FitOrientedBox(const LabelMap& labels, int label, const PointMm& towards_parent);

}  // namespace kvx
