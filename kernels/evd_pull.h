// A posed grid filled with what its voxels are in the template, on the device.
#pragma once
#include "kernels/evd_cells.h"
#include "kernels/sampling.h"

namespace kvx {

class EvdPull {
 public:
  explicit EvdPull(Backend& backend);
  // `air` where nothing lands. What evd_mend.cl says is mended, here and in labels.
  void Intensities(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
                   const PosedCells& cells, const Grid& posed_grid, const DeviceBuffer<float>& image,
                   const Grid& template_grid, Sampling sampling, float air, const cl::Buffer& out) const;
  // The label that prevails by its trilinear share; 0 where nothing lands. `levels`: for every label up to
  // the greatest, the share from which on it has a place that it shares with no other.
  void Labels(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
              const PosedCells& cells, const Grid& posed_grid, const DeviceBuffer<uint16_t>& labels,
              const DeviceBuffer<float>& levels, const Grid& template_grid, const cl::Buffer& out) const;
  // Four floats a voxel: the place in template voxels,
  // NaN where nothing lands, and what claims it (evd_bricks.cl.h).
  void Places(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
              const PosedCells& cells, const Grid& posed_grid, const cl::Buffer& out) const;

 private:
  template <class... Args>
  void Run(cl::CommandQueue& queue, const char* name, const DeviceBody& body, const cl::Buffer& list,
           const PosedCells& cells, const Grid& posed_grid, const Args&... args) const;
  template <class... Args>
  void Mend(cl::CommandQueue& queue, const char* name, const PosedCells& cells, const Grid& posed_grid,
            const Grid& template_grid, const Args&... args) const;
  cl::Program program_, mend_;
  size_t group_;  // work-items per tile
};

}  // namespace kvx
