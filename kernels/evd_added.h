// What a pose adds to its examples' displacements, at the stored template nodes, on the device.
#pragma once
#include "kernels/added_displacement.h"
#include "kernels/bricked_body.h"
#include "kernels/device/buffer_pool.h"

namespace kvx {

struct AddedNodes {
  AddedNodes(const Backend& backend, BufferCounts& counts);
  PooledBuffer<float> lattice;  // as it came
  PooledBuffer<float> voxels;   // [stored brick][axis][node], template voxels
  PooledBuffer<float> ranges;   // [stored brick]: least x, y, z, greatest x, y, z
};

class EvdAdded {
 public:
  explicit EvdAdded(Backend& backend);
  // `labels`: of the bones, on the template's grid of `image` voxels.
  void operator()(cl::CommandQueue& queue, const DeviceBody& body, const AddedDisplacement& added,
                  const DeviceBuffer<uint16_t>& labels, const Eigen::Vector3i& image, AddedNodes& out) const;

 private:
  cl::Program program_;
};

}  // namespace kvx
