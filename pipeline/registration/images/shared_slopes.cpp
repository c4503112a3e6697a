// The scan is read at the template's voxels, so that slopes of both are differences between the same voxels.
#include "pipeline/registration/images/shared_slopes.h"

#include <limits>

#include "core/host/parallel.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/registration/images/shown_voxels.h"

namespace kvx {
namespace {

Eigen::Matrix3d Symmetric(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return 0.5 * (a * b.transpose() + b * a.transpose());
}

// At the level's voxels; not a number where it shows none or they do not count.
std::vector<float> SeenOf(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm) {
  std::vector<float> seen(scan_mm.size(), std::numeric_limits<float>::quiet_NaN());
  ParallelEach(seen.size(), [&](size_t v) {
    if (const std::optional<PointVox> p = ShownAt(level, scan_mm, v))
      seen[v] = SampleTrilinear(level.scan, *p);
  });
  return seen;
}

// Per voxel of the grid; of a voxel that has neighbours on all sides.
Eigen::Vector3d SlopeAt(const std::vector<float>& image, const Grid& grid, size_t v) {
  const Eigen::Vector3i step(1, grid.size.x(), grid.size.x() * grid.size.y());
  Eigen::Vector3d slope;
  for (int a = 0; a < 3; ++a)
    slope[a] = 0.5 * (double(image[v + size_t(step[a])]) - double(image[v - size_t(step[a])]));
  return slope;
}

}  // namespace

SharedSlopes& SharedSlopes::operator+=(const SharedSlopes& other) {
  products += other.products, of_template += other.of_template, of_scan += other.of_scan;
  weight += other.weight;
  return *this;
}

SharedSlopes& SharedSlopes::operator-=(const SharedSlopes& other) {
  products -= other.products, of_template -= other.of_template, of_scan -= other.of_scan;
  weight -= other.weight;
  return *this;
}

Eigen::Matrix3d SharedSlopes::Information() const {
  if (weight <= 0) return Eigen::Matrix3d::Zero();
  return products - Symmetric(of_template, of_scan) / weight;
}

Image<SharedSlopes> SharedSlopesOfBlocks(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm) {
  const Grid& grid = level.grid;
  const std::vector<float> seen = SeenOf(level, scan_mm);
  const Eigen::Matrix3d mm_from_slopes = grid.VoxFromMm().transpose();
  Image<SharedSlopes> out(Coarsened(grid, kBlockVoxels));
  ParallelEach(out.values.size(), [&](size_t block) {
    const Eigen::Vector3i first = kBlockVoxels * out.grid.Ijk(block);
    const VoxelBox with_neighbours{first.cwiseMax(1),
                                   (first.array() + kBlockVoxels).min(grid.size.array() - 1).matrix()};
    SharedSlopes& sum = out.values[block];
    ForEachVoxel(with_neighbours, [&](const Eigen::Vector3i& p) {
      const size_t v = grid.Index(p.x(), p.y(), p.z());
      if (level.weight[v] <= 0) return;
      const Eigen::Vector3d s = mm_from_slopes * SlopeAt(seen, grid, v);
      if (!s.allFinite()) return;
      const Eigen::Vector3d t = mm_from_slopes * SlopeAt(level.intensity, grid, v);
      const double w = level.weight[v];
      sum += {w * Symmetric(s, t), w * t, w * s, w};
    });
  });
  return out;
}

}  // namespace kvx
