// The host side of kernels/cl/blend_deform.cl.
#include "kernels/blend_deform.h"

#include "core/blend.h"
#include "core/errors.h"
#include "kernels/device/device_buffer.h"
#include "kernels/device/launch.h"

namespace kvx {
namespace {

static_assert(sizeof(VoxelWeights) == 20, "the kernel reads five words a voxel");

// Positions far from the world's origin would cost single precision its digits: the kernel computes about the
// centre.
Grid Centred(const Grid& grid) {
  Grid centred = grid;
  centred.origin.lps -= grid.Middle().lps;
  return centred;
}

std::vector<float> PackAbout(const PointMm& centre, const PoseVector& pose) {
  std::vector<float> packed;
  for (const RigidTransform& t : pose) {
    const Eigen::Matrix3d r = t.rotation.toRotationMatrix();
    const Eigen::Vector3d shift = t.rotation * centre.lps + t.translation_mm - centre.lps;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) packed.push_back(float(r(row, column)));
      packed.push_back(float(shift[row]));
    }
    for (int c = 0; c < 4; ++c) packed.push_back(float(t.rotation.coeffs()[c]));
  }
  return packed;
}

}  // namespace

BlendField::BlendField(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("blend_deform.cl")) {}

DisplacementField BlendField::operator()(const WeightMap& weights,
                                         const PoseVector& scan_from_template) const {
  if (scan_from_template.empty()) throw InputError("a pose needs at least one bone");
  const auto map = DeviceBuffer<VoxelWeights>::Shared(backend_, weights.values);
  const std::vector<float> packed = PackAbout(weights.grid.Middle(), scan_from_template);
  const DeviceBuffer<float> rigid(backend_, std::span(packed));
  const DeviceBuffer<Eigen::Vector3f> field(backend_, weights.values.size());
  cl::Kernel kernel(program_, "blend_deform");
  SetArgs(kernel, map.buffer(), rigid.buffer(), ToCl(Centred(weights.grid)),
          cl_float2{{float(kSingularDeterminant), float(kRegularDeterminant)}}, field.buffer());
  Enqueue(backend_.queue(), kernel, weights.grid.size);
  DisplacementField out(weights.grid, Eigen::Vector3f::Zero());
  field.Download(backend_.queue(), out.values);
  return out;
}

}  // namespace kvx
