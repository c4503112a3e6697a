// Equation (2), v_a = (sum_j w_j T_j) v_s, at every template voxel, on the device.
#pragma once
#include "core/blend.h"
#include "kernels/backend.h"

namespace kvx {

// u(x) = v_a - v_s in mm at every voxel of the weights' grid.
DisplacementField BlendDeform(Backend& backend, const WeightMap& weights,
                              const PoseVector& scan_from_template);

}  // namespace kvx
