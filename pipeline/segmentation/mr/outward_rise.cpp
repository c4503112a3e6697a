// Faces at the border of the box count only where the scan goes on.
#include "pipeline/segmentation/mr/outward_rise.h"

namespace kvx {

SurfaceRise RiseOver(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  SurfaceRise surface;
  ForEachSurfaceFace(scan, box, mask, [&](size_t, double rise) { surface.Add(rise / level); });
  return surface;
}

double OutwardRise(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  return RiseOver(scan, level, box, mask).Mean();
}

}  // namespace kvx
