// CPU twin of kernels/blend_deform.h.
#pragma once
#include "core/pose.h"
#include "core/weight_map.h"

namespace kvx::reference {

DisplacementField BlendField(const WeightMap& weights, const PoseVector& scan_from_template);

}  // namespace kvx::reference
