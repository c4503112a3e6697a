// CT without strokes: bones by a level of intensity, their marrow filled, parted where they touch.
#pragma once
#include "core/image.h"

namespace kvx {

// At the surface of bone, in HU: where the scan changes fastest between soft tissue and cortex.
double FindBoneLevel(const Volume& scan);

// Labels 1, 2, ... by size, largest first; pieces under 0.2 cm3 are dropped. Throws InputError when nothing
// is left.
LabelMap ThresholdBones(const Volume& scan, double level_hu);

// The pieces of a mask, parted at necks: two parts stay one where the neck between them is nearly as thick as
// the thinner of them. 0 outside the mask.
Image<int32_t> PartAtNecks(const Mask& mask);

}  // namespace kvx
