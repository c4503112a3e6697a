// What the two images of a registration show of the same tissue, where the start brings them together.
#pragma once
#include <span>

#include "pipeline/registration/level_images.h"

namespace kvx {

struct ShownPair {
  Volume template_volume, scan;  // on the grids that they have in LevelImages
};

// Where either image has thick slices, each is blurred along whatever direction the other then shows less of
// (Liken); elsewhere both are as they are. `template_grid`: that the template was measured on; `start_mm`:
// where every voxel of the region starts, in scan mm.
ShownPair ShownAlike(const LevelImages& images, const Grid& template_grid,
                     std::span<const Eigen::Vector3f> start_mm);

}  // namespace kvx
