// A smooth bone looks much the same when it is turned by half about an axis of its box.
#pragma once
#include "pipeline/bones/search/bone_search.h"

namespace kvx {

// Holds every bone against its three half turns, at the scan's own voxels and with what the bones around it
// say. A twin that is clearly better takes the bone's place; otherwise the best twin is the runner-up, unless
// another pose comes nearer.
void CompareTwins(const BoneSearch& search, std::vector<Candidate>& found);

}  // namespace kvx
