// The template's values carried to a posed grid through the inverse of the forward map, on the device.
#pragma once
#include "core/image.h"
#include "kernels/bricked_body.h"

namespace kvx {

class EvdInverseSample {
 public:
  explicit EvdInverseSample(Backend& backend);
  // Trilinear; `air` where nothing lands.
  void Intensities(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
                   const OwnerVolume& owner, const Grid& posed_grid, const DeviceBuffer<float>& image,
                   const Grid& template_grid, float air, DeviceBuffer<float>& out) const;
  // Nearest; 0 where nothing lands.
  void Labels(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
              const OwnerVolume& owner, const Grid& posed_grid, const DeviceBuffer<uint16_t>& labels,
              const Grid& template_grid, DeviceBuffer<uint16_t>& out) const;

 private:
  cl::Program program_;
};

}  // namespace kvx
