// Resampling a volume through a displacement field, on the device.
#pragma once
#include "core/image.h"
#include "kernels/device/backend.h"

namespace kvx {

class Warp {
 public:
  explicit Warp(Backend& backend);

  // The moving volume seen on the field's (fixed) grid: out(x) = moving(x + u(x)), trilinear. Only at
  // `wanted` voxels of that grid: the others are `outside`, too.
  Volume operator()(const Volume& moving, const DisplacementField& moving_from_fixed, const Mask& wanted,
                    float outside = 0.0f) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
