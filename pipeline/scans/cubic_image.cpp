// Values and gradients of the spline, and what slices do not tell.
#include "pipeline/scans/cubic_image.h"

#include <algorithm>

#include "core/cubic_spline.h"
#include "core/finer_grid.h"
#include "core/parallel.h"

namespace kvx {
namespace {

// What the cubic through the neighbouring slices does not tell of each voxel, squared; empty without thick
// slices. More than is missed between two slices, which are closer; but neighbouring places miss the same.
Volume MissedVarianceOf(const Volume& volume) {
  const Eigen::Vector3i times = TimesTowardsCubes(volume.grid), &size = volume.grid.size;
  if ((times.array() == 1).all()) return {};
  Volume out(volume.grid);
  ParallelRanges(out.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      for (int a = 0; a < 3; ++a) {
        if (times[a] == 1) continue;
        const Eigen::Vector3i p = volume.grid.Ijk(v);
        const auto beside = [&](int slices) {
          Eigen::Vector3i q = p;
          q[a] = MirroredVoxel(p[a] + slices, size[a]);
          return volume(q.x(), q.y(), q.z());
        };
        const float told = (9 * (beside(1) + beside(-1)) - (beside(3) + beside(-3))) / 16;
        out.values[v] += (volume.values[v] - told) * (volume.values[v] - told);
      }
    }
  });
  return out;
}

}  // namespace

CubicImage::CubicImage(const Volume& volume)
    : coefficients_(SplineCoefficients(volume)), missed_variance_(MissedVarianceOf(volume)) {}

double CubicImage::MissedVariance(const Eigen::Vector3d& p) const {
  return missed_variance_.values.empty() ? 0.0 : SampleTrilinear(missed_variance_, PointVox{p});
}

bool CubicImage::At(const Eigen::Vector3d& p, double& value, Eigen::Vector3d& gradient) const {
  const Grid& grid = coefficients_.grid;
  for (int a = 0; a < 3; ++a) {
    if (!(p[a] >= 0 && p[a] <= grid.size[a] - 1)) return false;
  }
  const SplineTaps x(p.x(), grid.size.x()), y(p.y(), grid.size.y()), z(p.z(), grid.size.z());
  value = 0;
  gradient.setZero();
  for (int k = 0; k < 4; ++k) {
    double plane = 0, plane_dx = 0, plane_dy = 0;
    for (int j = 0; j < 4; ++j) {
      const float* row = coefficients_.values.data() + grid.Index(0, y.at[j], z.at[k]);
      double line = 0, line_dx = 0;
      for (int i = 0; i < 4; ++i) {
        const double c = row[x.at[i]];
        line += x.weight[i] * c;
        line_dx += x.slope[i] * c;
      }
      plane += y.weight[j] * line;
      plane_dx += y.weight[j] * line_dx;
      plane_dy += y.slope[j] * line;
    }
    value += z.weight[k] * plane;
    gradient += Eigen::Vector3d(z.weight[k] * plane_dx, z.weight[k] * plane_dy, z.slope[k] * plane);
  }
  return true;
}

}  // namespace kvx
