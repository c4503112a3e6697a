// Which voxels of a level are compared, and where they lie in the scan.
#pragma once
#include <optional>
#include <span>

#include "core/voxels/to_corner.h"
#include "kernels/block_level.h"

namespace kvx {

// In the scan's voxels; nothing of a voxel that does not count or that the scan does not show. `scan_mm`:
// where every voxel of the level lies.
inline std::optional<PointVox> ShownAt(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm,
                                       size_t voxel) {
  if (level.weight[voxel] <= 0) return std::nullopt;
  const PointVox p = level.scan.grid.ToVox(PointMm{scan_mm[voxel].cast<double>()});
  return level.scan.grid.Contains(p) ? std::optional(p) : std::nullopt;
}

// Calls visit(voxel, place in the scan's voxels) for those of the 2 x 2 x 2 voxels from `first` on that count
// and that the scan shows.
template <class Visit>
void ForEachShown(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm,
                  const Eigen::Vector3i& first, const Visit& visit) {
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i q = first + ToCorner(c);
    const size_t v = level.grid.Index(q.x(), q.y(), q.z());
    if (const std::optional<PointVox> p = ShownAt(level, scan_mm, v)) visit(v, *p);
  }
}

}  // namespace kvx
