// The host side of kernels/cl/evd_added.cl.
#include "kernels/evd_added.h"

#include "kernels/device/launch.h"

namespace kvx {
namespace {

cl_int4 ToInt4(const Eigen::Vector3i& v) { return {{v.x(), v.y(), v.z(), 0}}; }

cl_float4 PerVoxel(const Eigen::Vector3i& step) {
  return {{1 / float(step.x()), 1 / float(step.y()), 1 / float(step.z()), 0}};
}

}  // namespace

AddedNodes::AddedNodes(const Backend& backend, BufferCounts& counts)
    : lattice(backend, counts), voxels(backend, counts), ranges(backend, counts) {}

EvdAdded::EvdAdded(Backend& backend) : program_(backend.programs().Build("evd_added.cl")) {}

void EvdAdded::operator()(cl::CommandQueue& queue, const DeviceBody& body, const AddedDisplacement& added,
                          const DeviceBuffer<uint16_t>& labels, const Eigen::Vector3i& image,
                          AddedNodes& out) const {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  out.lattice.Upload(queue, {added.voxels.front().data(), 3 * added.voxels.size()});
  out.voxels.Require(size_t(body.stored) * 3 * BrickedBody::kNodes);
  out.ranges.Require(size_t(body.stored) * 6);
  if (body.stored == 0) return;
  cl::Kernel kernel(program_, "spread_added");
  SetArgs(kernel, body.stored, body.first_nodes.buffer(), out.lattice.buffer(), ToInt4(added.size),
          ToInt4(added.first), PerVoxel(added.step), labels.buffer(), ToInt4(image), out.voxels.buffer(),
          out.ranges.buffer());
  Enqueue(queue, kernel, size_t(body.stored));
}

}  // namespace kvx
