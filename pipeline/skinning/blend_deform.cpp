// Equation (2) by its kernel.
#include "pipeline/skinning/blend_deform.h"

#include "kernels/blend_deform.h"

namespace kvx {

DisplacementField BlendDeform(Backend& backend, const WeightMap& weights,
                              const PoseVector& scan_from_template) {
  return BlendField(backend)(weights, scan_from_template);
}

}  // namespace kvx
