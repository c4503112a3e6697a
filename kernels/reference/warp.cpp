// Plain loops, double precision.
#include "kernels/reference/warp.h"

namespace kvx::reference {

Volume Warp(const Volume& moving, const DisplacementField& moving_from_fixed, const Mask& wanted,
            float outside) {
  const Grid& fixed = moving_from_fixed.grid;
  Volume out(fixed, outside);
  for (size_t v = 0; v < out.values.size(); ++v) {
    if (!wanted.values[v]) continue;
    const Eigen::Vector3d x =
        fixed.ToMm(PointVox{fixed.Ijk(v).cast<double>()}).lps + moving_from_fixed.values[v].cast<double>();
    constexpr double kRounding = 1e-3;  // as in grid.cl.h
    const PointVox at = moving.grid.ToVox(PointMm{x}), p = moving.grid.Nearest(at);
    const bool inside = ((at.ijk - p.ijk).array().abs() <= kRounding).all();
    out.values[v] = inside ? SampleTrilinear(moving, p) : outside;
  }
  return out;
}

}  // namespace kvx::reference
