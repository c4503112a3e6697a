// The host side of kernels/cl/evd_forward.cl.
#include "kernels/evd_forward.h"

#include "kernels/launch.h"

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

ForwardPose::ForwardPose(const Grid& from, const Grid& to, const PoseVector& pose, const Eigen::MatrixXf& c,
                         const std::vector<float>& scales) {
  const Eigen::Vector3d centre =
      from.ToMm(PointVox{0.5 * (from.size.array() - 1).cast<double>().matrix()}).lps;
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
  AppendRows(to_mm, mm_from_vox, from.origin.lps - centre);
  AppendRows(from_mm, vox_from_mm, vox_from_mm * (centre - to.origin.lps));
  volume_ratio = float(to.MmFromVox().determinant() / mm_from_vox.determinant());
  examples = c.size() && c.cwiseAbs().maxCoeff() > 0 ? int(c.cols()) : 0;
  for (int j = 0; j < c.rows(); ++j) {
    for (int k = 0; k < examples; ++k) coefficients.push_back(c(j, k) * scales[k]);
  }
}

EvdForward::EvdForward(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("evd_forward.cl")) {}

void EvdForward::operator()(cl::CommandQueue& queue, const DeviceBody& body, const ForwardPose& pose,
                            PosedNodes& posed) const {
  DeviceBuffer<cl_float4> bones(backend_, pose.bones.size()), to(backend_, 3), from(backend_, 3);
  DeviceBuffer<float> coefficients(backend_, pose.coefficients.size());
  bones.Upload(queue, pose.bones);
  to.Upload(queue, pose.to_mm);
  from.Upload(queue, pose.from_mm);
  coefficients.Upload(queue, pose.coefficients);
  cl::Kernel kernel(program_, "evd_forward");
  SetArgs(kernel, body.first_nodes.buffer(), body.bones.buffer(), body.weights.buffer(),
          body.examples.buffer(), pose.examples, body.example_count, coefficients.buffer(), bones.buffer(),
          to.buffer(), from.buffer(), pose.volume_ratio, body.stored, posed.buffer());
  Enqueue(queue, kernel, size_t(body.stored) * BrickedBody::kNodes);
  queue.finish();  // the uploads above end with this scope
}

void EvdForward::Shift(cl::CommandQueue& queue, const DeviceBody& body, const Eigen::Vector3d& voxels,
                       PosedNodes& posed) const {
  if (body.stored == 0 || voxels.isZero()) return;
  cl::Kernel kernel(program_, "shift_posed");
  const cl_float4 shift{{float(voxels.x()), float(voxels.y()), float(voxels.z()), 0.0f}};
  SetArgs(kernel, shift, body.stored * BrickedBody::kNodes, posed.buffer());
  Enqueue(queue, kernel, size_t(body.stored) * BrickedBody::kNodes);
}

}  // namespace kvx
