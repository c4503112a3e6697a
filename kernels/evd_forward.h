// Eq. 6 at every stored template node, on the device.
#pragma once
#include "core/blend.h"
#include "kernels/bricked_body.h"

namespace kvx {

// A pose as the kernels take it: from voxels of the template grid to voxels of the posed grid.
struct ForwardPose {
  ForwardPose(const Grid& template_grid, const Grid& posed_grid, const PoseVector& scan_from_template,
              const Eigen::MatrixXf& coefficients, const std::vector<float>& example_scales);
  std::vector<cl_float4> bones;           // kBoneRows per bone, see kernels/cl/evd_forward.cl
  std::vector<cl_float4> to_mm, from_mm;  // centred mm <-> voxels, 3 rows each
  std::vector<float> coefficients;        // bones x examples, scales folded in
  int examples = 0;                       // 0 when all coefficients are 0
  float volume_ratio = 1;                 // of one posed voxel to one template voxel, signed by handedness
  static constexpr int kBoneRows = 5;
};

class EvdForward {
 public:
  explicit EvdForward(Backend& backend);
  void operator()(cl::CommandQueue& queue, const DeviceBody& body, const ForwardPose& pose,
                  PosedNodes& posed) const;
  // Adds whole voxels to places that are there: the same pose on another grid of the same lattice.
  void Shift(cl::CommandQueue& queue, const DeviceBody& body, const Eigen::Vector3d& voxels,
             PosedNodes& posed) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
