// Parts of shells and of spongy bone, joined where as much mineral goes on from one to the other as along
// either: depth tells necks of what is solid only.
#pragma once
#include "pipeline/segmentation/ct/neck_parts.h"

namespace kvx {

// Of the mean cross-section of the thinner part. Bones that touch have a fifth and less, pieces of one bone
// as much as each and more.
constexpr double kLeastSeam = 0.7;

// Numbers of the voxels' parts after joining, 0 outside. Two parts become one where the mineral in the seam
// between them, density times area, is at least `least_seam` of the thinner one's mean cross-section; not
// where both are solid. `scan_hu`: Hounsfield units, on the parts' grid.
Image<int32_t> JoinedParts(const Volume& scan_hu, NeckParts parts, double least_seam);

}  // namespace kvx
