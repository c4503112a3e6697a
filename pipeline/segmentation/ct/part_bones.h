// Bones of a CT that touch, apart: all at once, from all strokes.
#pragma once
#include "core/image.h"

namespace kvx {

// `found`: labels of what belongs to bones, right or wrong; where it has one, the result has one. Each voxel
// of `strokes` that `found` gives its own label keeps it. A box around all bones of more than `most_voxels`
// is looked at in blocks of voxels.
LabelMap PartedBones(const Volume& scan_hu, const LabelMap& strokes, LabelMap found,
                     size_t most_voxels = 12'000'000);

}  // namespace kvx
