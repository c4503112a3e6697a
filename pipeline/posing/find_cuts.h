// Where the template's body joins parts that a pose may draw apart: fingers that touch in the scan.
#pragma once
#include "core/bone.h"
#include "kernels/bricked_body.h"

namespace kvx {

// Per brick with cells: the unit cells across which the weights jump between bones that are neither the same
// nor parent and child nor children of one bone, the cells beside those,
// and those at which the grid cuts the body off.
std::vector<std::array<uint64_t, 2>> FindCuts(const BrickedBody& body, const BoneSet& bones,
                                              const WeightMap& weights);

}  // namespace kvx
