// Values and gradients of the spline, and what slices do not tell.
#include "pipeline/scans/cubic_image.h"

#include "core/host/parallel.h"
#include "core/voxels/cubic_spline.h"
#include "core/voxels/finer_grid.h"

namespace kvx {
namespace {

// What the cubic through the neighbouring slices does not tell of each voxel, squared; empty without thick
// slices. More than is missed between two slices, which are closer; but neighbouring places miss the same.
Volume MissedVarianceOf(const Volume& volume) {
  const Eigen::Vector3i times = TimesTowardsCubes(volume.grid), &size = volume.grid.size;
  if ((times.array() == 1).all()) return {};
  Volume out(volume.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
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
  });
  return out;
}

}  // namespace

CubicImage::CubicImage(Volume volume)
    : missed_variance_(MissedVarianceOf(volume)), coefficients_(SplineCoefficients(std::move(volume))) {}

double CubicImage::MissedVariance(const Eigen::Vector3d& p) const {
  return missed_variance_.values.empty() ? 0.0 : SampleTrilinear(missed_variance_, PointVox{p});
}

bool CubicImage::At(const Eigen::Vector3d& p, double& value, Eigen::Vector3d& gradient) const {
  const Grid& grid = coefficients_.grid;
  for (int a = 0; a < 3; ++a) {
    if (!(p[a] >= 0 && p[a] <= grid.size[a] - 1)) return false;
  }
  const SplineTaps x(p.x(), grid.size.x()), y(p.y(), grid.size.y()), z(p.z(), grid.size.z());
  const bool together = x.at[3] - x.at[0] == 3;  // not mirrored
  // Of the four coefficients along x at once: values, then slopes along y and z.
  Eigen::Array4d along = Eigen::Array4d::Zero(), along_dy = along, along_dz = along;
  for (int k = 0; k < 4; ++k) {
    Eigen::Array4d plane = Eigen::Array4d::Zero(), plane_dy = plane;
    for (int j = 0; j < 4; ++j) {
      const float* row = coefficients_.values.data() + grid.Index(0, y.at[j], z.at[k]);
      const Eigen::Array4d c =
          (together ? Eigen::Array4f(Eigen::Map<const Eigen::Array4f>(row + x.at[0]))
                    : Eigen::Array4f(row[x.at[0]], row[x.at[1]], row[x.at[2]], row[x.at[3]]))
              .cast<double>();
      plane += y.weight[j] * c;
      plane_dy += y.slope[j] * c;
    }
    along += z.weight[k] * plane;
    along_dy += z.weight[k] * plane_dy;
    along_dz += z.slope[k] * plane;
  }
  const Eigen::Map<const Eigen::Array4d> weight(x.weight), slope(x.slope);
  value = (weight * along).sum();
  gradient << (slope * along).sum(), (weight * along_dy).sum(), (weight * along_dz).sum();
  return true;
}

}  // namespace kvx
