// Plain loops, double precision.
#include "kernels/reference/pyramid.h"

#include "core/voxels/to_corner.h"

namespace kvx::reference {
namespace {

double At(const Volume& volume, const Eigen::Vector3i& p) {
  const Eigen::Vector3i q = volume.grid.Nearest(p);
  return volume(q.x(), q.y(), q.z());
}

}  // namespace

Volume Smoothed(const Volume& volume, const Eigen::Vector3i& reach) {
  Volume out = volume;
  for (int axis = 0; axis < 3; ++axis) {
    const Volume in = out;
    const Eigen::Vector3i step = reach[axis] * Eigen::Vector3i::Unit(axis);
    for (size_t v = 0; v < in.values.size(); ++v) {
      const Eigen::Vector3i p = in.grid.Ijk(v);
      out.values[v] = float(0.75 * At(in, p) + 0.125 * (At(in, p - step) + At(in, p + step)));
    }
  }
  return out;
}

Volume Halved(const Volume& volume) {
  Volume out(Coarsened(volume.grid, 2));
  for (size_t v = 0; v < out.values.size(); ++v) {
    double sum = 0;
    for (int c = 0; c < 8; ++c) sum += At(volume, 2 * out.grid.Ijk(v) + ToCorner(c));
    out.values[v] = float(sum / 8);
  }
  return out;
}

}  // namespace kvx::reference
