// The host side of kernels/cl/fill_gaps.cl.
#include "kernels/fill_gaps.h"

#include "kernels/launch.h"

namespace kvx {

FillGaps::FillGaps(Backend& backend) : program_(backend.programs().Build("fill_gaps.cl")) {}

void FillGaps::operator()(cl::CommandQueue& queue, const OwnerVolume& owner, const Grid& posed_grid, float air,
                          DeviceBuffer<float>& values) const {
  cl::Kernel kernel(program_, "fill_gaps");
  SetArgs(kernel, owner.buffer(), ToCl(posed_grid).size, air, values.buffer());
  Enqueue(queue, kernel, posed_grid.size);
}

}  // namespace kvx
