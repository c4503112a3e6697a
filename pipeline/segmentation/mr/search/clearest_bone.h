// Of several answers for one bone, the one that the picture shows best.
#pragma once
#include <span>

#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

// Number of the candidate with most surface over dark cortex and least over anything else. `level`: intensity
// of the bone's marrow. At least one candidate.
size_t ClearestBone(const Volume& scan, double level, std::span<const FoundBone> candidates);

}  // namespace kvx
