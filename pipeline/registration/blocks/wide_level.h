// A level as blocks twice as wide see it.
#pragma once
#include "kernels/block_level.h"

namespace kvx {

// On a grid twice as coarse: which voxels count, greys, firmness, and the same bending energy. No images and
// no map: wide blocks are solved on the level's own (BlockWidth::kWide).
BlockLevel WideLevel(const BlockLevel& level);

}  // namespace kvx
