// Trilinear sampling: the oracle of every sampling kernel.
#include "core/image.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

// Calls visit(i, j, k, weight) for the 8 voxels around p, which must lie in the hull of voxel centres.
template <class Visit>
void ForEachCorner(const Grid& grid, const Eigen::Vector3d& p, Visit visit) {
  Eigen::Vector3i lo;
  Eigen::Vector3d f;
  for (int a = 0; a < 3; ++a) {
    lo[a] = std::clamp(int(std::floor(p[a])), 0, std::max(0, grid.size[a] - 2));
    f[a] = std::clamp(p[a] - lo[a], 0.0, 1.0);
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    double weight = 1.0;
    Eigen::Vector3i at;
    for (int a = 0; a < 3; ++a) {
      weight *= d[a] ? f[a] : 1.0 - f[a];
      at[a] = std::min(lo[a] + d[a], grid.size[a] - 1);
    }
    visit(at.x(), at.y(), at.z(), weight);
  }
}

}  // namespace

float SampleTrilinear(const Volume& volume, const PointVox& p, float outside) {
  if (!volume.grid.Contains(p)) return outside;
  double sum = 0;
  ForEachCorner(volume.grid, p.ijk, [&](int i, int j, int k, double w) { sum += w * volume(i, j, k); });
  return float(sum);
}

Eigen::Vector3d SampleTrilinear(const DisplacementField& field, const PointVox& p) {
  const Eigen::Vector3d top = (field.grid.size.array() - 1).cast<double>().matrix();
  const Eigen::Vector3d inside = p.ijk.cwiseMax(0.0).cwiseMin(top);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  ForEachCorner(field.grid, inside,
                [&](int i, int j, int k, double w) { sum += w * field(i, j, k).cast<double>(); });
  return sum;
}

}  // namespace kvx
