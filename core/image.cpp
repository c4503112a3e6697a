// Trilinear sampling: the oracle of every sampling kernel.
#include "core/image.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

// Calls visit(index, weight) for the 8 voxels around p, which must lie in the hull of voxel centres.
template <class Visit>
void ForEachCorner(const Grid& grid, const Eigen::Vector3d& p, Visit visit) {
  const size_t stride[3] = {1, size_t(grid.size.x()), size_t(grid.size.x()) * grid.size.y()};
  size_t first = 0, step[3];
  double weight[3][2];
  for (int a = 0; a < 3; ++a) {
    const int lo = std::clamp(int(p[a]), 0, std::max(0, grid.size[a] - 2));
    weight[a][1] = std::clamp(p[a] - lo, 0.0, 1.0);
    weight[a][0] = 1.0 - weight[a][1];
    first += lo * stride[a];
    step[a] = grid.size[a] > 1 ? stride[a] : 0;
  }
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
    visit(first + x * step[0] + y * step[1] + z * step[2], weight[0][x] * weight[1][y] * weight[2][z]);
  }
}

}  // namespace

float SampleTrilinear(const Volume& volume, const PointVox& p, float outside) {
  if (!volume.grid.Contains(p)) return outside;
  double sum = 0;
  ForEachCorner(volume.grid, p.ijk, [&](size_t voxel, double w) { sum += w * volume.values[voxel]; });
  return float(sum);
}

Eigen::Vector3d SampleTrilinear(const DisplacementField& field, const PointVox& p) {
  const Eigen::Vector3d top = (field.grid.size.array() - 1).cast<double>().matrix();
  const Eigen::Vector3d inside = p.ijk.cwiseMax(0.0).cwiseMin(top);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  ForEachCorner(field.grid, inside,
                [&](size_t voxel, double w) { sum += w * field.values[voxel].cast<double>(); });
  return sum;
}

}  // namespace kvx
