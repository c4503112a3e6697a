// The host side of kernels/cl/pyramid.cl.
#include "kernels/pyramid.h"

#include "kernels/device/launch.h"

namespace kvx {
namespace {

cl_int4 ToCl(const Eigen::Vector3i& v) { return {{v.x(), v.y(), v.z(), 0}}; }

}  // namespace

Pyramid::Pyramid(Backend& backend) : backend_(backend), program_(backend.programs().Build("pyramid.cl")) {}

Volume Pyramid::Smoothed(const Volume& volume, const Eigen::Vector3i& reach) const {
  const auto in = DeviceBuffer<float>::Shared(backend_, volume.values);
  const DeviceBuffer<float> a(backend_, volume.values.size()), b(backend_, volume.values.size());
  const auto smooth = [&](const DeviceBuffer<float>& from, int axis, const DeviceBuffer<float>& to) {
    cl::Kernel kernel(program_, "smooth_axis");
    SetArgs(kernel, from.buffer(), ToCl(volume.grid.size), ToCl(reach[axis] * Eigen::Vector3i::Unit(axis)),
            to.buffer());
    Enqueue(backend_.queue(), kernel, volume.grid.size);
  };
  smooth(in, 0, a);
  smooth(a, 1, b);
  smooth(b, 2, a);
  Volume out(volume.grid);
  a.Download(backend_.queue(), out.values);
  return out;
}

Volume Pyramid::Halved(const Volume& volume) const {
  Volume out(Coarsened(volume.grid, 2));
  const auto in = DeviceBuffer<float>::Shared(backend_, volume.values);
  const DeviceBuffer<float> half(backend_, out.values.size());
  cl::Kernel kernel(program_, "halve");
  SetArgs(kernel, in.buffer(), ToCl(volume.grid.size), ToCl(out.grid.size), half.buffer());
  Enqueue(backend_.queue(), kernel, out.grid.size);
  half.Download(backend_.queue(), out.values);
  return out;
}

void Pyramid::Halve(cl::CommandQueue& queue, const cl::Buffer& in, const Grid& in_grid,
                    const cl::Buffer& out) const {
  const Grid half = Coarsened(in_grid, 2);
  cl::Kernel kernel(program_, "halve");
  SetArgs(kernel, in, ToCl(in_grid).size, ToCl(half).size, out);
  Enqueue(queue, kernel, half.size);
}

}  // namespace kvx
