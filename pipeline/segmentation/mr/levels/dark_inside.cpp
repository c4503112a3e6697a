#include "pipeline/segmentation/mr/levels/dark_inside.h"

#include "core/voxels/dilated.h"

namespace kvx {

double DarkInside(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  constexpr double kDeepVoxels = 1.5, kDark = 0.7;
  const Mask deep = Eroded(mask, kDeepVoxels * scan.grid.MeanSpacingMm());
  size_t dark = 0, all = 0;
  ForEachVoxel(box, scan.grid, [&](const auto&, size_t part, size_t whole) {
    all += deep.values[part] != 0;
    dark += deep.values[part] && scan.values[whole] < kDark * level;
  });
  return double(dark) / double(std::max<size_t>(all, 1));
}

}  // namespace kvx
