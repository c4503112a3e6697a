// Launch geometry.
#include "kernels/device/launch.h"

namespace kvx {
namespace {

size_t RoundUp(size_t n, size_t group) { return (n + group - 1) / group * group; }

void Rows(const Eigen::Matrix3d& linear, const Eigen::Vector3d& shift, cl_float4 (&rows)[3]) {
  for (int r = 0; r < 3; ++r) {
    rows[r] = {{float(linear(r, 0)), float(linear(r, 1)), float(linear(r, 2)), float(shift[r])}};
  }
}

// `wanted`, halved until the device has groups of so many.
size_t GroupFor(const cl::CommandQueue& queue, const cl::Kernel& kernel, size_t wanted) {
  const size_t most = MostItems(kernel, queue.getInfo<CL_QUEUE_DEVICE>());
  while (wanted > most) wanted /= 2;
  return wanted;
}

}  // namespace

ClGrid ToCl(const Grid& grid) {
  ClGrid out;
  Rows(grid.MmFromVox(), grid.origin.lps, out.mm_from_vox);
  Rows(grid.VoxFromMm(), -(grid.VoxFromMm() * grid.origin.lps), out.vox_from_mm);
  out.size = {{grid.size.x(), grid.size.y(), grid.size.z(), 0}};
  return out;
}

size_t MostItems(const cl::Kernel& kernel, const cl::Device& device) {
  return kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device);
}

void EnqueueGroups(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t group) {
  if (items == 0) return;  // which OpenCL 1.2 forbids
  queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(RoundUp(items, group)), cl::NDRange(group));
}

void Enqueue(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t group) {
  EnqueueGroups(queue, kernel, items, GroupFor(queue, kernel, group));
}

void EnqueueRows(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t rows) {
  const size_t group = GroupFor(queue, kernel, 64);
  queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(RoundUp(items, group), rows),
                             cl::NDRange(group, 1));
}

void Enqueue(cl::CommandQueue& queue, const cl::Kernel& kernel, const Eigen::Vector3i& size) {
  if (size.minCoeff() <= 0) return;
  size_t row = 32, rows = 4;
  const size_t most = MostItems(kernel, queue.getInfo<CL_QUEUE_DEVICE>());
  while (row * rows > most) (rows > 1 ? rows : row) /= 2;
  queue.enqueueNDRangeKernel(kernel, cl::NullRange,
                             cl::NDRange(RoundUp(size.x(), row), RoundUp(size.y(), rows), size.z()),
                             cl::NDRange(row, rows, 1));
}

}  // namespace kvx
