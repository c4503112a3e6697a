// Tissue that only one of two registered images shows, or shows otherwise: partial volume in creases, blood,
// what was squeezed.
#pragma once
#include <span>
#include <vector>

#include "kernels/block_level.h"

namespace kvx {

// Where the images disagree by more than their weights allow, over the cells beside a place, weights are
// divided by how much: what they cannot agree in must not pull tissue elsewhere. `levels`: finest first;
// `scan_mm`: where every voxel of the finest lies.
void CountOutliersLess(std::span<const Eigen::Vector3f> scan_mm, std::vector<BlockLevel>& levels);

}  // namespace kvx
