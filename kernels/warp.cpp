// The host side of kernels/cl/warp_trilinear.cl.
#include "kernels/warp.h"

#include "kernels/device/device_buffer.h"
#include "kernels/device/launch.h"

namespace kvx {

Warp::Warp(Backend& backend) : backend_(backend), program_(backend.programs().Build("warp_trilinear.cl")) {}

Volume Warp::operator()(const Volume& moving, const DisplacementField& moving_from_fixed, const Mask& wanted,
                        float outside) const {
  const auto image = DeviceBuffer<float>::Shared(backend_, moving.values);
  const auto field = DeviceBuffer<Eigen::Vector3f>::Shared(backend_, moving_from_fixed.values);
  const auto where = DeviceBuffer<uint8_t>::Shared(backend_, wanted.values);
  const DeviceBuffer<float> result(backend_, moving_from_fixed.values.size());
  cl::Kernel kernel(program_, "warp_trilinear");  // one per call: setting arguments is not thread-safe
  SetArgs(kernel, image.buffer(), ToCl(moving.grid), field.buffer(), ToCl(moving_from_fixed.grid),
          where.buffer(), outside, result.buffer());
  Enqueue(backend_.queue(), kernel, moving_from_fixed.grid.size);
  Volume out(moving_from_fixed.grid);
  result.Download(backend_.queue(), out.values);
  return out;
}

}  // namespace kvx
