// Cortex is as dark as air. Most of it lies between bright tissue, and holes are filled; beside a tendon, or
// at the scan's border, it does not.
#pragma once
#include "core/bone.h"

namespace kvx {

// Adds to the body the bone in its gaps: where labels say bone, and no air as wide as a ball of 5 mm reaches.
// What they say in wider air (a map that was shifted, or is too large) is not taken.
Mask WithDarkBone(Mask body, const LabelMap& bones);

}  // namespace kvx
