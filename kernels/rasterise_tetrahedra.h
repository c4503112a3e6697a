// Scan conversion of posed template cells into an owner volume, on the device.
#pragma once
#include "core/grid.h"
#include "kernels/bricked_body.h"

namespace kvx {

struct PosedBricks {
  PosedBricks(Backend& backend, const DeviceBody& body);
  DeviceBuffer<uint8_t> smooth;  // per brick with cells: scan-converted as one cell
  DeviceBuffer<int32_t> folded;  // body cells turned inside out
  DeviceBuffer<cl_float4> box;   // least and greatest posed body node, two per brick
};

class RasteriseTetrahedra {
 public:
  explicit RasteriseTetrahedra(Backend& backend);
  void Classify(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed, float volume_ratio,
                PosedBricks& out) const;
  // Fills `owner`, one value per voxel of `posed_grid`.
  void operator()(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
                  const PosedBricks& bricks, const Grid& template_grid, const Grid& posed_grid,
                  OwnerVolume& owner) const;

 private:
  cl::Program program_;
};

}  // namespace kvx
