// The host side of kernels/cl/evd_forward.cl.
#include "kernels/evd_forward.h"

#include "core/blend.h"
#include "kernels/device/launch.h"

namespace kvx {
namespace {

void AppendRows(std::vector<cl_float4>& rows, const Eigen::Matrix3d& linear, const Eigen::Vector3d& shift) {
  for (int r = 0; r < 3; ++r) {
    rows.push_back({{float(linear(r, 0)), float(linear(r, 1)), float(linear(r, 2)), float(shift[r])}});
  }
}

cl_float4 ToFloat4(const Eigen::Quaterniond& q) {
  return {{float(q.x()), float(q.y()), float(q.z()), float(q.w())}};
}

}  // namespace

ForwardPose::ForwardPose(const Grid& from, const Grid& to, const PoseVector& pose, const Eigen::MatrixXf& c) {
  const Eigen::Vector3d centre = from.Middle().lps;
  const Eigen::Matrix3d vox_from_mm = to.VoxFromMm(), mm_from_vox = from.MmFromVox();
  for (const RigidTransform& t : pose) {
    const Eigen::Matrix3d r = t.rotation.toRotationMatrix();
    AppendRows(bones, vox_from_mm * r * mm_from_vox,
               vox_from_mm * (r * from.origin.lps + t.translation_mm - to.origin.lps));
    const Eigen::Vector3d half = 0.5 * (r * centre + t.translation_mm - centre);
    const Eigen::Quaterniond dual = Eigen::Quaterniond(0, half.x(), half.y(), half.z()) * t.rotation;
    bones.push_back(ToFloat4(t.rotation));
    bones.push_back(ToFloat4(dual));
  }
  AppendRows(frames, mm_from_vox, from.origin.lps - centre);
  AppendRows(frames, vox_from_mm, vox_from_mm * (centre - to.origin.lps));
  volume_ratio = float(to.MmFromVox().determinant() / mm_from_vox.determinant());
  examples = c.size() && c.cwiseAbs().maxCoeff() > 0 ? int(c.cols()) : 0;
  for (int j = 0; j < c.rows(); ++j) {
    for (int k = 0; k < examples; ++k) coefficients.push_back(c(j, k));
  }
}

PosedNodes::PosedNodes(const Backend& backend, BufferCounts& counts)
    : bones(backend, counts),
      frames(backend, counts),
      coefficients(backend, counts),
      places(backend, counts),
      body_boxes(backend, counts) {}

void PosedNodes::Upload(cl::CommandQueue& queue, const ForwardPose& pose) {
  bones.Upload(queue, pose.bones);
  frames.Upload(queue, pose.frames);
  coefficients.Upload(queue, pose.coefficients);
}

EvdForward::EvdForward(Backend& backend) : program_(backend.programs().Build("evd_forward.cl")) {}

void EvdForward::operator()(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
                            int count, const ForwardPose& pose, PosedNodes& posed,
                            const AddedNodes* added) const {
  posed.Upload(queue, pose);
  posed.places.Require(size_t(body.stored) * 3 * BrickedBody::kNodes);
  posed.body_boxes.Require(2 * size_t(body.stored));
  if (count == 0) return;
  cl::Kernel kernel(program_, "evd_forward");
  SetArgs(kernel, list, count, body.first_nodes.buffer(), body.palette_first.buffer(), body.palette.buffer(),
          body.weights.buffer(), body.example_first.buffer(), body.example_refs.buffer(),
          body.examples.buffer(), posed.coefficients.buffer(), pose.examples,
          added ? added->voxels.buffer() : posed.coefficients.buffer(), int(added != nullptr),
          posed.bones.buffer(), posed.frames.buffer(), pose.volume_ratio,
          cl_float2{{float(kSingularDeterminant), float(kRegularDeterminant)}}, body.body.buffer(),
          posed.places.buffer(), posed.body_boxes.buffer());
  Enqueue(queue, kernel, size_t(count));
}

}  // namespace kvx
