// What the two images of a registration show of the same tissue, where the start brings them together.
#pragma once
#include <span>

#include "pipeline/registration/images/level_images.h"

namespace kvx {

struct ShownPair {
  Volume template_volume, scan;               // on the grids that they have in LevelImages
  double template_noise = 1, scan_noise = 1;  // what is left of either's, beside what was measured
  double voxel_mm3 = 0;  // where they were blurred: of a voxel that shows as much as either does then
};

// Along whatever direction one of them shows less, the other is blurred as much (Liken); where they show
// about as much as each other, both are as they are. `template_grid`: that the template was measured on;
// `start_mm`: where every voxel of the region starts, in scan mm.
ShownPair ShownAlike(const LevelImages& images, const Grid& template_grid,
                     std::span<const Eigen::Vector3f> start_mm);

}  // namespace kvx
