// The host side of kernels/cl/evd_inverse_sample.cl.
#include "kernels/evd_inverse_sample.h"

#include "kernels/launch.h"

namespace kvx {

EvdInverseSample::EvdInverseSample(Backend& backend)
    : program_(backend.programs().Build("evd_inverse_sample.cl")) {}

void EvdInverseSample::Intensities(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
                                   const OwnerVolume& owner, const Grid& posed_grid,
                                   const DeviceBuffer<float>& image, const Grid& template_grid, float air,
                                   DeviceBuffer<float>& out) const {
  cl::Kernel kernel(program_, "sample_intensities");
  SetArgs(kernel, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(), posed.buffer(),
          body.carried.buffer(), owner.buffer(), ToCl(posed_grid).size, image.buffer(),
          ToCl(template_grid).size, air, out.buffer());
  Enqueue(queue, kernel, posed_grid.size);
}

void EvdInverseSample::Labels(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
                              const OwnerVolume& owner, const Grid& posed_grid,
                              const DeviceBuffer<uint16_t>& labels, const Grid& template_grid,
                              DeviceBuffer<uint16_t>& out) const {
  cl::Kernel kernel(program_, "sample_labels");
  SetArgs(kernel, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(), posed.buffer(),
          body.carried.buffer(), owner.buffer(), ToCl(posed_grid).size, labels.buffer(),
          ToCl(template_grid).size, out.buffer());
  Enqueue(queue, kernel, posed_grid.size);
}

}  // namespace kvx
