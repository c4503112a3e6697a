// A smooth bone looks much the same when it is turned by half about an axis of its box, and coarse images
// show bones in more places than where they are.
#pragma once
#include "pipeline/bones/search/bone_search.h"

namespace kvx {

// Holds every bone against its three half turns, and one with rivals whose parent has none against these, at
// the scan's own voxels and with what the bones around it say. What is clearly better takes the bone's place;
// otherwise the best of them is the runner-up.
void CompareTwins(const BoneSearch& search, std::vector<Candidate>& found);

}  // namespace kvx
