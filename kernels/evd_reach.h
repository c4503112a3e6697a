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
  PooledBuffer<cl_float4> boxes, bones, narrower;  // of the pose that was bounded
  PooledBuffer<float> coefficients;
  PooledBuffer<uint8_t> reaches;
  std::vector<int32_t> host_nodes, host_cells;  // kept for their memory
  std::vector<uint8_t> needed;
};

class EvdReach {
 public:
  explicit EvdReach(Backend& backend);
  // The box of every brick, in voxels of the grid that `pose` goes to: the template's. `added`: to the
  // examples' displacements, if any.
  void Bound(cl::CommandQueue& queue, const DeviceBody& body, const ForwardPose& pose, ReachingBricks& out,
             const AddedNodes* added = nullptr) const;
  // What may reach `posed_grid`, by the boxes found before. `on_host` is the body that `body`
  // was uploaded from.
  void operator()(cl::CommandQueue& queue, const BrickedBody& on_host, const DeviceBody& body,
                  const Grid& template_grid, const Grid& posed_grid, ReachingBricks& out) const;
  // The bricks (`out.nodes`) among whose body nodes are, by the boxes found before, the outermost along every
  // axis: few, so that the box of the posed body costs little.
  void Outermost(cl::CommandQueue& queue, const BrickedBody& on_host, ReachingBricks& out) const;
  // Posed voxels by which cells may reach beyond their nodes, where parts may draw apart and elsewhere.
  static float CutMargin(const Grid& template_grid, const Grid& posed_grid);
  static float Margin(const Grid& template_grid, const Grid& posed_grid);

 private:
  cl::Program program_;
};

}  // namespace kvx
