// The posed bricks cut into cells whose inverse is known, on the device.
#pragma once
#include "core/grid.h"
#include "kernels/evd_forward.h"

namespace kvx {

// The layout of KvxCell in kernels/cl/evd_bricks.cl.h.
struct EvdCell {
  float inverse[12], middle[3], edge;
  int32_t first_node[3];
  float core, reach, slack;
  int32_t tetrahedron, steps, inverted, all_inner;
  float squares[9], products[9], cube[3];
  int32_t nodes;
};
static_assert(sizeof(EvdCell) == 192);

struct EvdBox {
  int32_t lo[3], hi[3], unused[2];
};

struct BrickCells {
  int32_t box[6], folded, unused;
};

// The cells of a pose, and which tile of the posed grid meets which brick.
struct PosedCells {
  PosedCells(const Backend& backend, BufferCounts& counts);
  PooledBuffer<EvdCell> cells;
  PooledBuffer<EvdBox> boxes;         // of the cells
  PooledBuffer<BrickCells> found;     // per listed brick
  PooledBuffer<cl_int2> ranges;       // eight per listed brick: first cell, how many
  PooledBuffer<cl_float4> nodes;      // blocks of 5x5x5 posed nodes
  PooledBuffer<int32_t> used;         // cells beyond one per brick; blocks
  PooledBuffer<uint32_t> tile_first;  // per tile and one more
  PooledBuffer<int32_t> in_tile;      // places in the list of bricks
  PooledBuffer<uint32_t> claimed;     // room for evd_pull.cl: 64 words per tile
  cl_int4 tiles{};
  int64_t folded = 0;  // unit cells of body turned inside out
  // Host copies, kept for their memory.
  std::vector<int32_t> host_in_tile;
  std::vector<uint32_t> host_tile_first;
  static constexpr int kTile[3] = {16, 8, 8};  // posed voxels, see kernels/cl/evd_pull.cl.h
};

class EvdCells {
 public:
  explicit EvdCells(Backend& backend);
  // `shift`: from the grid the nodes were posed on to `posed_grid`, a grid of the same lattice, in voxels.
  void operator()(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list, int count,
                  const PosedNodes& posed, const Eigen::Vector3d& shift, const Grid& template_grid,
                  const Grid& posed_grid, PosedCells& out) const;

 private:
  bool Cut(cl::CommandQueue& queue, cl::Kernel& kernel, int count, PosedCells& out) const;
  cl::Program program_;
};

}  // namespace kvx
