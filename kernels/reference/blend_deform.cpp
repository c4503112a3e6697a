// Plain loops over core/blend.h, double precision.
#include "kernels/reference/blend_deform.h"

#include "core/blend.h"

namespace kvx::reference {

DisplacementField BlendField(const WeightMap& weights, const PoseVector& scan_from_template) {
  DisplacementField out(weights.grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3d x = out.grid.ToMm(PointVox{out.grid.Ijk(v).cast<double>()}).lps;
    out.values[v] = (Apply(Blend(weights.values[v], scan_from_template), x) - x).cast<float>();
  }
  return out;
}

}  // namespace kvx::reference
