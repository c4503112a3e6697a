// Closes gaps of one or two voxels inside a posed body, on the device.
#pragma once
#include "core/grid.h"
#include "kernels/bricked_body.h"

namespace kvx {

class FillGaps {
 public:
  explicit FillGaps(Backend& backend);
  // `values` on `posed_grid`, `air` where nothing landed; changed in place.
  void operator()(cl::CommandQueue& queue, const OwnerVolume& owner, const Grid& posed_grid, float air,
                  DeviceBuffer<float>& values) const;

 private:
  cl::Program program_;
};

}  // namespace kvx
