// The inverse of the posed bricks on the device: a cell where they are smooth, what lands in their unit cells
// elsewhere.
#pragma once
#include "core/grid.h"
#include "kernels/evd_forward.h"

namespace kvx {

// The layouts of KvxCell, KvxChunk and KvxBrickCells in kernels/cl/evd_bricks.cl.h.
struct EvdCell {
  float inverse[12], middle[3], core, reach, slack;
  int32_t steps, all_inner, bone_nodes;
  float squares[9], products[9], cube[3];
  int32_t unused[2];
};
static_assert(sizeof(EvdCell) == 176);

struct EvdChunk {
  int32_t next;
  float base[3];
  int32_t tile[64];
  uint32_t landing[64][2];
};
static_assert(sizeof(EvdChunk) == 784);

struct BrickCells {
  int32_t box[6], folded, first_chunk;
};

// The inverse of a pose, brick by brick, and which tile of the posed grid meets which brick.
struct PosedCells {
  PosedCells(const Backend& backend, BufferCounts& counts);
  PooledBuffer<EvdCell> cells;         // per listed brick
  PooledBuffer<BrickCells> found;      // per listed brick
  PooledBuffer<EvdChunk> chunks;       // what lands in those that are not smooth
  PooledBuffer<int32_t> used;          // chunks
  PooledBuffer<uint32_t> tile_first;   // per tile and one more
  PooledBuffer<int32_t> in_tile;       // places in the list of bricks
  PooledBuffer<cl_float4> bones_back;  // per bone, three rows: template voxels by posed voxels
  PooledBuffer<uint32_t> claimed;      // room for evd_pull.cl: a word per row of every tile
  cl_int4 tiles{};
  int64_t folded = 0;  // unit cells of body turned inside out
  // Host copies, kept for their memory.
  std::vector<int32_t> host_in_tile;
  std::vector<uint32_t> host_tile_first;
  static constexpr int kTile[3] = {16, 8, 8};  // posed voxels, see kernels/cl/evd_bricks.cl.h
  static constexpr size_t kTileRows = size_t(kTile[1]) * kTile[2], kTileVoxels = kTile[0] * kTileRows;
  size_t TileCount() const { return size_t(tiles.s[0]) * tiles.s[1] * tiles.s[2]; }
};

class EvdCells {
 public:
  explicit EvdCells(Backend& backend);
  // `shift`: from the grid the nodes were posed on to `posed_grid`, a grid of the same lattice, in voxels.
  void operator()(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list, int count,
                  const PosedNodes& posed, const PoseVector& pose, const Eigen::Vector3d& shift,
                  const Grid& template_grid, const Grid& posed_grid, PosedCells& out) const;

 private:
  bool Invert(cl::CommandQueue& queue, cl::Kernel& kernel, cl_uint room_argument, int count,
              PosedCells& out) const;
  cl::Program program_;
};

}  // namespace kvx
