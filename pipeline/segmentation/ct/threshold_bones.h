// CT without strokes: what is denser than a level, holes filled, parted where bones touch.
#pragma once
#include "core/image.h"
#include "pipeline/segmentation/ct/joined_parts.h"

namespace kvx {

// At the surface of bone, in HU: where the scan changes fastest between soft tissue and cortex.
double FindBoneLevel(const Volume& scan);

// Where bones are parted by a threshold of `level_hu`: there, or at the level that FindBoneLevel finds where
// that is clearly higher. At low levels spongy ends of bones are filled, and necks part them from their
// shafts.
double PartingLevel(const Volume& scan, double level_hu);

// Labels 1, 2, ... by size, largest first; pieces under 0.2 cm3 are dropped. `least_seam`: as of JoinedParts.
// Throws InputError when nothing is left.
LabelMap ThresholdBones(const Volume& scan, double level_hu, double least_seam = kLeastSeam);

}  // namespace kvx
