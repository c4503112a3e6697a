// Eq. 6 at the stored template nodes, on the device.
#pragma once
#include "core/pose.h"
#include "kernels/bricked_body.h"
#include "kernels/device/buffer_pool.h"
#include "kernels/evd_added.h"

namespace kvx {

// A pose as the kernels take it: from voxels of the template grid to voxels of the posed grid.
struct ForwardPose {
  ForwardPose(const Grid& template_grid, const Grid& posed_grid, const PoseVector& scan_from_template,
              const Eigen::MatrixXf& coefficients);
  std::vector<cl_float4> bones;     // kBoneRows per bone (KVX_BONE_ROWS), see kernels/cl/evd_forward.cl
  std::vector<cl_float4> frames;    // template voxels -> centred mm, centred mm -> posed voxels, 3 rows each
  std::vector<float> coefficients;  // bones x examples
  int examples = 0;                 // 0 when all coefficients are 0
  float volume_ratio = 1;           // of one posed voxel to one template voxel, signed by handedness
  static constexpr size_t kBoneRows = 5;
};

// The pose and what it does to the nodes, on the device.
struct PosedNodes {
  PosedNodes(const Backend& backend, BufferCounts& counts);
  void Upload(cl::CommandQueue& queue, const ForwardPose& pose);
  PooledBuffer<cl_float4> bones, frames;
  PooledBuffer<float> coefficients;
  PooledBuffer<float> places;          // [stored brick][axis][node], voxels of the posed grid
  PooledBuffer<cl_float4> body_boxes;  // least and greatest body node of each listed brick
};

class EvdForward {
 public:
  explicit EvdForward(Backend& backend);
  // Poses the listed bricks. `added`: to the examples' displacements, if any.
  void operator()(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list, int count,
                  const ForwardPose& pose, PosedNodes& posed, const AddedNodes* added = nullptr) const;

 private:
  cl::Program program_;
};

}  // namespace kvx
