// Volume blend deformation (eq. 2) at every voxel of the weights' grid, on the device.
#pragma once
#include "core/pose.h"
#include "core/weight_map.h"
#include "kernels/device/backend.h"

namespace kvx {

class BlendField {
 public:
  explicit BlendField(Backend& backend);

  // u(x) = v_a - v_s in mm.
  DisplacementField operator()(const WeightMap& weights, const PoseVector& scan_from_template) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
