// CPU twin of kernels/blend_deform.h.
#pragma once
#include "core/blend.h"

namespace kvx::reference {

DisplacementField BlendField(const WeightMap& weights, const PoseVector& scan_from_template);

}  // namespace kvx::reference
