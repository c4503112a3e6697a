// The host side of kernels/cl/evd_pull.cl and evd_mend.cl.
#include "kernels/evd_pull.h"

#include "kernels/device/launch.h"
#include "kernels/evd_specks.h"

namespace kvx {
namespace {

constexpr size_t kTileBytes = PosedCells::kTileVoxels * (sizeof(cl_int) + 3 * sizeof(cl_float));  // KvxTile
enum Mending : cl_int { kFill = 0, kClear = 1 };  // KVX_FILL, KVX_CLEAR
cl_int4 SizeOf(const Grid& grid) { return {{grid.size.x(), grid.size.y(), grid.size.z(), 0}}; }

// On a CPU one work-item does a tile by itself: its vectors fill the machine. On a GPU each takes a row, as
// far as the device lets them; their number is a power of two.
size_t ItemsPerTile(const Backend& backend, const cl::Program& program) {
  size_t items = backend.is_cpu() ? 1 : 64;
  for (const char* name : {"pull_intensities", "pull_labels", "pull_places"})
    while (items > MostItems(cl::Kernel(program, name), backend.device())) items /= 2;
  return items;
}

}  // namespace

EvdPull::EvdPull(Backend& backend)
    : program_(backend.programs().Build("evd_pull.cl")),
      mend_(backend.programs().Build("evd_mend.cl")),
      group_(ItemsPerTile(backend, program_)) {}

template <class... Args>
void EvdPull::Run(cl::CommandQueue& queue, const char* name, const DeviceBody& body, const cl::Buffer& list,
                  const PosedCells& cells, const Grid& grid, const Args&... args) const {
  cl::Kernel kernel(program_, name);
  SetArgs(kernel, list, cells.found.buffer(), cells.cells.buffer(), cells.chunks.buffer(),
          body.tissue.buffer(), cells.tile_first.buffer(), cells.in_tile.buffer(), body.bone_cells.buffer(),
          body.bone_size, cells.bones_back.buffer(), cells.tiles, SizeOf(grid), cells.claimed.buffer(),
          cl::Local(kTileBytes), args...);
  EnqueueGroups(queue, kernel, cells.TileCount() * group_, group_);
}

// Fills first, then clears: one after the other, as the first reads what the second takes away.
template <class... Args>
void EvdPull::Mend(cl::CommandQueue& queue, const char* name, const PosedCells& cells, const Grid& grid,
                   const Grid& template_grid, const Args&... args) const {
  for (const cl_int what : {kFill, kClear}) {
    if (what == kClear && !HoldsSpecks(grid, template_grid)) continue;
    cl::Kernel kernel(mend_, name);
    SetArgs(kernel, cells.claimed.buffer(), cells.tile_first.buffer(), cells.tiles, SizeOf(grid), what,
            args...);
    Enqueue(queue, kernel, cells.TileCount(), 16);
  }
}

void EvdPull::Intensities(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
                          const PosedCells& cells, const Grid& grid, const DeviceBuffer<float>& image,
                          const Grid& template_grid, Sampling sampling, float air,
                          const cl::Buffer& out) const {
  Run(queue, "pull_intensities", body, list, cells, grid, image.buffer(), SizeOf(template_grid),
      int(sampling == Sampling::kCubic), air, out);
  Mend(queue, "mend_intensities", cells, grid, template_grid, air, out);
}

void EvdPull::Labels(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
                     const PosedCells& cells, const Grid& grid, const DeviceBuffer<uint16_t>& labels,
                     const DeviceBuffer<float>& levels, const Grid& template_grid,
                     const cl::Buffer& out) const {
  Run(queue, "pull_labels", body, list, cells, grid, labels.buffer(), SizeOf(template_grid), levels.buffer(),
      out);
  Mend(queue, "mend_labels", cells, grid, template_grid, out);
}

void EvdPull::Places(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list,
                     const PosedCells& cells, const Grid& grid, const cl::Buffer& out) const {
  Run(queue, "pull_places", body, list, cells, grid, out);
}

}  // namespace kvx
