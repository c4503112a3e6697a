// Smoothing and coarsening of volumes for the outer multiresolution, on the device.
#pragma once
#include "core/image.h"
#include "kernels/device/device_buffer.h"

namespace kvx {

class Pyramid {
 public:
  explicit Pyramid(Backend& backend);

  // (1 6 1) / 8 along every axis, of neighbours `reach` voxels away: a Gaussian of half of that.
  Volume Smoothed(const Volume& volume, const Eigen::Vector3i& reach = Eigen::Vector3i::Ones()) const;
  Volume Halved(const Volume& volume) const;  // means over 2 x 2 x 2 voxels, on Coarsened(grid, 2)
  // The same between buffers, without waiting.
  void Halve(cl::CommandQueue& queue, const cl::Buffer& in, const Grid& in_grid, const cl::Buffer& out) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
