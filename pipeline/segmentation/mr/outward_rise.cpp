// Faces at the border of the box count only where the scan goes on.
#include "pipeline/segmentation/mr/outward_rise.h"

namespace kvx {

double OutwardRise(const Volume& scan, double level, const VoxelBox& box, const Mask& mask) {
  constexpr double kMost = 0.3;
  double sum = 0;
  size_t faces = 0;
  ForEachVoxel(box, scan.grid, [&](const Eigen::Vector3i& p, size_t part, size_t whole) {
    if (!mask.values[part]) return;
    for (int side = 0; side < 6; ++side) {
      const Eigen::Vector3i step = (side % 2 ? 1 : -1) * Eigen::Vector3i::Unit(side / 2);
      const Eigen::Vector3i next = p + step, out = next + box.low;
      if (!scan.grid.Contains(out)) continue;
      if (mask.grid.Contains(next) && mask(next.x(), next.y(), next.z())) continue;
      const double rise = (scan(out.x(), out.y(), out.z()) - scan.values[whole]) / level;
      sum += std::clamp(rise, -kMost, kMost), ++faces;
    }
  });
  return faces == 0 ? -1.0 : sum / double(faces);
}

}  // namespace kvx
