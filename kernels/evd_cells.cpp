// The host side of kernels/cl/evd_cells.cl, and the lists of bricks per tile.
#include "kernels/evd_cells.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "kernels/device/launch.h"

namespace kvx {
namespace {

cl_float4 ToFloat4(const Eigen::Vector3d& v) { return {{float(v.x()), float(v.y()), float(v.z()), 0.0f}}; }

// First and last tile that a brick's cells may reach, per axis; false where they miss the grid.
bool TilesOf(const BrickCells& brick, const Grid& grid, Eigen::Vector3i& first, Eigen::Vector3i& last) {
  for (int a = 0; a < 3; ++a) {
    const int lo = std::max(brick.box[a], 0), hi = std::min(brick.box[a + 3], grid.size[a] - 1);
    if (lo > hi) return false;
    first[a] = lo / PosedCells::kTile[a], last[a] = hi / PosedCells::kTile[a];
  }
  return true;
}

template <class Visit>
void ForEachTile(const BrickCells& brick, const Grid& grid, const cl_int4& tiles, Visit visit) {
  Eigen::Vector3i first, last;
  if (!TilesOf(brick, grid, first, last)) return;
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) visit((size_t(z) * tiles.s[1] + y) * tiles.s[0] + x);
    }
  }
}

// Counting sort: within a tile the bricks keep their order.
void SortIntoTiles(std::span<const BrickCells> bricks, const Grid& grid, PosedCells& out) {
  out.host_tile_first.assign(out.TileCount() + 2, 0);  // shifted by one: the filling below moves it back
  for (const BrickCells& brick : bricks)
    ForEachTile(brick, grid, out.tiles, [&](size_t tile) { ++out.host_tile_first[tile + 2]; });
  std::partial_sum(out.host_tile_first.begin(), out.host_tile_first.end(), out.host_tile_first.begin());
  out.host_in_tile.resize(out.host_tile_first.back());
  for (size_t n = 0; n < bricks.size(); ++n) {
    ForEachTile(bricks[n], grid, out.tiles,
                [&](size_t tile) { out.host_in_tile[out.host_tile_first[tile + 1]++] = int32_t(n); });
  }
}

std::vector<cl_float4> BonesBack(const PoseVector& pose, const Grid& from, const Grid& to) {
  const Eigen::Matrix3d vox_from_mm = from.VoxFromMm(), mm_from_vox = to.MmFromVox();
  std::vector<cl_float4> rows;
  for (const RigidTransform& posed_from_template : pose) {
    const RigidTransform back = posed_from_template.Inverse();
    const Eigen::Matrix3d linear = vox_from_mm * back.rotation.toRotationMatrix() * mm_from_vox;
    const Eigen::Vector3d shift = from.ToVox(back * to.origin).ijk;
    for (int r = 0; r < 3; ++r) {
      const Eigen::RowVector3d row = linear.row(r);
      rows.push_back({{float(row[0]), float(row[1]), float(row[2]), float(shift[r])}});
    }
  }
  return rows;
}

}  // namespace

PosedCells::PosedCells(const Backend& backend, BufferCounts& counts)
    : cells(backend, counts),
      found(backend, counts),
      chunks(backend, counts),
      used(backend, counts),
      tile_first(backend, counts),
      in_tile(backend, counts),
      bones_back(backend, counts),
      claimed(backend, counts) {}

EvdCells::EvdCells(Backend& backend) : program_(backend.programs().Build("evd_cells.cl")) {}

// Enqueues the kernel with the room there is, the argument from which on all are set here; grows what was too
// small and returns false.
bool EvdCells::Invert(cl::CommandQueue& queue, cl::Kernel& kernel, cl_uint room_argument, int count,
                      PosedCells& out) const {
  out.used.Upload(queue, std::array<int32_t, 1>{0});
  SetArgsFrom(room_argument, kernel, cl_int(std::min<size_t>(out.chunks.capacity(), INT32_MAX)),
              out.used.buffer(), out.cells.buffer(), out.chunks.buffer(), out.found.buffer());
  Enqueue(queue, kernel, size_t(count), 16);
  size_t chunks = 0;
  out.used.Read(queue, 1, [&](std::span<const int32_t> used) { chunks = size_t(used[0]); });
  const bool fits = chunks <= out.chunks.capacity();
  out.chunks.Require(chunks);
  return fits;
}

void EvdCells::operator()(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list, int count,
                          const PosedNodes& posed, const PoseVector& pose, const Eigen::Vector3d& shift,
                          const Grid& from, const Grid& to, PosedCells& out) const {
  for (int a = 0; a < 3; ++a) out.tiles.s[a] = (to.size[a] + PosedCells::kTile[a] - 1) / PosedCells::kTile[a];
  const size_t bricks = std::max<size_t>(1, size_t(count));
  out.cells.Require(bricks), out.found.Require(bricks);
  out.chunks.Require((bricks + 1) / 2);  // mostly enough, so that the first pose need not run twice
  const float ratio = float(to.MmFromVox().determinant() / from.MmFromVox().determinant());
  const auto sort = [&](std::span<const BrickCells> found) {
    out.folded = 0;
    for (const BrickCells& brick : found) out.folded += brick.folded;
    SortIntoTiles(found, to, out);
  };
  if (count > 0) {
    cl::Kernel kernel(program_, "evd_cells");
    const cl_uint room_argument =
        SetArgs(kernel, list, count, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(),
                posed.places.buffer(), body.tissue.buffer(), body.cuts.buffer(), ToFloat4(shift), ratio,
                ToFloat4(to.spacing_mm), ToFloat4(from.spacing_mm),
                cl_int4{{to.size.x(), to.size.y(), to.size.z(), 0}}, out.tiles);
    while (!Invert(queue, kernel, room_argument, count, out)) {
    }
    out.found.Read(queue, size_t(count), sort);
  } else {
    sort({});
  }
  out.bones_back.Upload(queue, BonesBack(pose, from, to));
  out.tile_first.Upload(queue, out.host_tile_first);
  out.in_tile.Upload(queue, out.host_in_tile);
  out.claimed.Require(PosedCells::kTileRows * out.TileCount());
}

}  // namespace kvx
