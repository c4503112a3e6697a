// Setting arguments and enqueueing: one line each, errors thrown as cl::Error.
#pragma once
#include "core/grid.h"
#include "kernels/device/opencl.h"

namespace kvx {

// The layout of KvxGrid in kernels/cl/grid.cl.h.
struct ClGrid {
  cl_float4 mm_from_vox[3];  // rows of the affine: (a, b, c, translation)
  cl_float4 vox_from_mm[3];
  cl_int4 size;
};
ClGrid ToCl(const Grid& grid);

// From argument `index` on; returns the number of the one that comes next.
template <class... Args>
cl_uint SetArgsFrom(cl_uint index, cl::Kernel& kernel, const Args&... args) {
  (kernel.setArg(index++, args), ...);
  return index;
}
template <class... Args>
cl_uint SetArgs(cl::Kernel& kernel, const Args&... args) {
  return SetArgsFrom(0, kernel, args...);
}

// Work-items that a group of this kernel may have on the device: OpenCL promises one.
size_t MostItems(const cl::Kernel& kernel, const cl::Device& device);

// Rounds `items` up to whole groups; every kernel checks its bounds. The second for kernels whose work-items
// share local memory: those of a group of just this size.
void Enqueue(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t group = 64);
void EnqueueGroups(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t group);
// One work-item per item of each row: x, y = item, row. Groups as above.
void EnqueueRows(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t rows);
// One work-item per voxel: x, y, z = i, j, k. Groups as above.
void Enqueue(cl::CommandQueue& queue, const cl::Kernel& kernel, const Eigen::Vector3i& size);

}  // namespace kvx
