// Faces at the border of the box count only where the scan goes on.
#include "pipeline/segmentation/mr/shells/outward_rise.h"

namespace kvx {

SurfaceRise RiseOver(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  SurfaceRise surface;
  ForEachSurfaceFace(scan, box, mask, [&](size_t, double rise) { surface.Add(rise / level); });
  return surface;
}

double ShareUnclear(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  constexpr double kHardly = 0.06;
  size_t unclear = 0, faces = 0;
  ForEachSurfaceFace(scan, box, mask,
                     [&](size_t, double rise) { unclear += rise < kHardly * level, ++faces; });
  return double(unclear) / double(std::max<size_t>(faces, 1));
}

double OutwardRise(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  return RiseOver(scan, level, box, mask).Mean();
}

}  // namespace kvx
