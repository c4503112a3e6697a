// What of a CT cannot be bone, without anybody's word.
#pragma once
#include "core/image.h"

namespace kvx {

constexpr float kThinnestHu = -300;  // of marrow and of the tissue around bones; less is air

// Voxels that are joined to air by a way that keeps 8 mm (or one and a half of the longest edge of a voxel)
// away from all that is dense, but for what is so in air (DropPiecesInAir). The shell of a bone keeps them
// out of its marrow, gaps and all. Empty where the scan holds no air. `scan_hu`: Hounsfield units.
Mask OutsideOfBones(const Volume& scan_hu);

}  // namespace kvx
