// Canals through bones in CT, as the spinal one, that were taken for bone.
#pragma once
#include "core/voxels/voxel_box.h"

namespace kvx {

// Whether a part of the bone is as soft as what lies around bones, wide enough for a ball of 3 mm, hardly
// marked by its strokes, and goes on outside: into tissue as soft, or beyond the view at two opposite ends.
// Marrow is as soft, but enclosed; in a shaft that the view cuts twice it is taken for fat. `box`: of
// the bone.
bool HoldsCanal(const Volume& scan_hu, const LabelMap& labels, const LabelMap& strokes, int label,
                const VoxelBox& box);

}  // namespace kvx
