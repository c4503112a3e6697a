// Which bricks may reach a posed grid, or end the posed body, on the device: a plane or a region needs few of
// them.
#pragma once
#include "core/grid.h"
#include "kernels/evd_forward.h"

namespace kvx {

// The bricks to pose and the bricks whose cells to cut, both in rising order.
struct ReachingBricks {
  ReachingBricks(const Backend& backend, BufferCounts& counts);
  PooledBuffer<int32_t> nodes, cells;
  int node_count = 0, cell_count = 0;
  PooledBuffer<cl_float4> boxes;
  PooledBuffer<uint8_t> reaches;
  std::vector<int32_t> host_nodes, host_cells;  // kept for their memory
  std::vector<uint8_t> needed;
};

class EvdReach {
 public:
  explicit EvdReach(Backend& backend);
  // `on_host` is the body that `body` was uploaded from. Uploads the pose into `posed` on the way.
  void operator()(cl::CommandQueue& queue, const BrickedBody& on_host, const DeviceBody& body,
                  const ForwardPose& pose, const Grid& template_grid, const Grid& posed_grid,
                  PosedNodes& posed, ReachingBricks& out) const;
  // The bricks (`out.nodes`) among whose body nodes are the outermost along every axis: few, so that the box
  // of the posed body costs little.
  void Outermost(cl::CommandQueue& queue, const BrickedBody& on_host, const DeviceBody& body,
                 const ForwardPose& pose, PosedNodes& posed, ReachingBricks& out) const;
  // Posed voxels by which cells may reach beyond their nodes.
  static float Margin(const Grid& template_grid, const Grid& posed_grid);

 private:
  void Bound(cl::CommandQueue& queue, const DeviceBody& body, const ForwardPose& pose, PosedNodes& posed,
             ReachingBricks& out) const;
  cl::Program program_;
};

}  // namespace kvx
