// Which voxels of a level are compared, and where they lie in the scan.
#pragma once
#include <span>

#include "core/voxels/to_corner.h"
#include "kernels/block_level.h"

namespace kvx {

// Calls visit(voxel, place in the scan's voxels) for those of the 2 x 2 x 2 voxels from `first` on that count
// and that the scan shows. `scan_mm`: where every voxel of the level lies.
template <class Visit>
void ForEachShown(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm,
                  const Eigen::Vector3i& first, const Visit& visit) {
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i q = first + ToCorner(c);
    const size_t v = level.grid.Index(q.x(), q.y(), q.z());
    if (level.weight[v] <= 0) continue;
    const PointVox p = level.scan.grid.ToVox(PointMm{scan_mm[v].cast<double>()});
    if (level.scan.grid.Contains(p)) visit(v, p);
  }
}

}  // namespace kvx
