// CT without strokes: what is denser than a level, holes filled, parted where bones touch.
#pragma once
#include <optional>

#include "core/image.h"
#include "pipeline/segmentation/ct/joined_parts.h"
#include "pipeline/segmentation/ct/pieces_in_air.h"

namespace kvx {

// At the surface of bone, in HU: where the scan changes fastest between soft tissue and cortex.
double FindBoneLevel(const Volume& scan);

struct BoneLevels {
  double bone_hu;     // what is denser is bone
  double parting_hu;  // where bones are parted: there, or clearly higher
};

// `given_hu`, or what FindBoneLevel finds. Bones are parted where that is found when it is clearly higher: at
// low levels spongy ends of bones are filled, and necks part them from their shafts.
BoneLevels LevelsOf(const Volume& scan, std::optional<double> given_hu);

struct DenseBones {
  LabelMap labels;  // 1, 2, ... by size, largest first
  DenseInAir in_air;
};

// Pieces under 0.2 cm3 are dropped. `least_seam`: as of JoinedParts. Throws InputError when nothing is left.
DenseBones ThresholdBones(const Volume& scan, const BoneLevels& levels, double least_seam = kLeastSeam);

}  // namespace kvx
