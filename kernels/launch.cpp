// Launch geometry.
#include "kernels/launch.h"

namespace kvx {
namespace {

size_t RoundUp(size_t n, size_t group) { return (n + group - 1) / group * group; }

void Rows(const Eigen::Matrix3d& linear, const Eigen::Vector3d& shift, cl_float4 (&rows)[3]) {
  for (int r = 0; r < 3; ++r) {
    rows[r] = {{float(linear(r, 0)), float(linear(r, 1)), float(linear(r, 2)), float(shift[r])}};
  }
}

}  // namespace

ClGrid ToCl(const Grid& grid) {
  ClGrid out;
  Rows(grid.MmFromVox(), grid.origin.lps, out.mm_from_vox);
  Rows(grid.VoxFromMm(), -(grid.VoxFromMm() * grid.origin.lps), out.vox_from_mm);
  out.size = {{grid.size.x(), grid.size.y(), grid.size.z(), 0}};
  return out;
}

void Enqueue(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t items, size_t group) {
  queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(RoundUp(items, group)), cl::NDRange(group));
}

void Enqueue(cl::CommandQueue& queue, const cl::Kernel& kernel, const Eigen::Vector3i& size) {
  constexpr size_t kRow = 32, kRows = 4;
  queue.enqueueNDRangeKernel(kernel, cl::NullRange,
                             cl::NDRange(RoundUp(size.x(), kRow), RoundUp(size.y(), kRows), size.z()),
                             cl::NDRange(kRow, kRows, 1));
}

}  // namespace kvx
