// The host side of kernels/cl/evd_cells.cl, and the lists of bricks per tile.
#include "kernels/evd_cells.h"

#include <algorithm>
#include <numeric>

#include "kernels/launch.h"

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
  for (int a = 0; a < 3; ++a) out.tiles.s[a] = (grid.size[a] + PosedCells::kTile[a] - 1) / PosedCells::kTile[a];
  const size_t tiles = size_t(out.tiles.s[0]) * out.tiles.s[1] * out.tiles.s[2];
  out.host_tile_first.assign(tiles + 2, 0);  // shifted by one: the filling below moves it back
  for (const BrickCells& brick : bricks)
    ForEachTile(brick, grid, out.tiles, [&](size_t tile) { ++out.host_tile_first[tile + 2]; });
  std::partial_sum(out.host_tile_first.begin(), out.host_tile_first.end(), out.host_tile_first.begin());
  out.host_in_tile.resize(out.host_tile_first.back());
  for (size_t n = 0; n < bricks.size(); ++n) {
    ForEachTile(bricks[n], grid, out.tiles,
                [&](size_t tile) { out.host_in_tile[out.host_tile_first[tile + 1]++] = int32_t(n); });
  }
}

// Whole bricks hold one cell at their place in the list; the cells of the others follow. Returns how many in all.
size_t PlaceCells(std::span<const BrickCells> bricks, PosedCells& out) {
  size_t next = bricks.size();
  out.host_ranges.clear(), out.host_fine.clear(), out.host_offsets.clear();
  out.folded = 0;
  for (size_t n = 0; n < bricks.size(); ++n) {
    out.folded += bricks[n].folded;
    if (bricks[n].cells == 0) {
      out.host_ranges.push_back({{cl_int(n), 1}});
      continue;
    }
    const int parts = bricks[n].cells - 1;
    out.host_ranges.push_back({{cl_int(next), parts}});
    if (parts == 0) continue;
    out.host_fine.push_back(int32_t(n));
    out.host_offsets.push_back(int32_t(next));
    next += size_t(parts);
  }
  return next;
}

}  // namespace

PosedCells::PosedCells(const Backend& backend, BufferCounts& counts)
    : cells(backend, counts),
      found(backend, counts),
      fine(backend, counts),
      offsets(backend, counts),
      ranges(backend, counts),
      tile_first(backend, counts),
      in_tile(backend, counts) {}

EvdCells::EvdCells(Backend& backend) : program_(backend.programs().Build("evd_cells.cl")) {}

void EvdCells::operator()(cl::CommandQueue& queue, const DeviceBody& body, const cl::Buffer& list, int count,
                          const PosedNodes& posed, const Eigen::Vector3d& shift, const Grid& from, const Grid& to,
                          PosedCells& out) const {
  out.cells.Require(std::max<size_t>(1, size_t(count)));
  out.found.Require(std::max<size_t>(1, size_t(count)));
  const float ratio = float(to.MmFromVox().determinant() / from.MmFromVox().determinant());
  cl::Kernel coarse(program_, "evd_cells"), fine(program_, "evd_fine_cells");
  size_t cells = 0;
  if (count > 0) {
    SetArgs(coarse, list, count, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(),
            posed.places.buffer(), body.tissue.buffer(), body.cuts.buffer(), ToFloat4(shift), ratio,
            ToFloat4(to.spacing_mm), ToFloat4(from.spacing_mm), out.cells.buffer(), out.found.buffer());
    Enqueue(queue, coarse, size_t(count));
  }
  const auto sort = [&](std::span<const BrickCells> bricks) {
    cells = PlaceCells(bricks, out);
    SortIntoTiles(bricks, to, out);
  };
  if (count > 0) out.found.Read(queue, size_t(count), sort);
  else sort({});
  out.fine.Upload(queue, out.host_fine);
  out.offsets.Upload(queue, out.host_offsets);
  out.ranges.Upload(queue, out.host_ranges);
  out.tile_first.Upload(queue, out.host_tile_first);
  out.in_tile.Upload(queue, out.host_in_tile);
  if (out.host_fine.empty()) return;
  if (cells > out.cells.capacity()) {  // the whole bricks' cells move along
    const cl::Buffer before = out.cells.buffer();
    out.cells.Require(cells);
    queue.enqueueCopyBuffer(before, out.cells.buffer(), 0, 0, size_t(count) * sizeof(EvdCell));
  }
  SetArgs(fine, list, out.fine.buffer(), out.offsets.buffer(), int(out.host_fine.size()), body.brick_at.buffer(),
          body.bricks, body.first_nodes.buffer(), posed.places.buffer(), body.tissue.buffer(),
          body.cuts.buffer(), ToFloat4(shift), ratio, ToFloat4(to.spacing_mm), ToFloat4(from.spacing_mm),
          out.cells.buffer());
  Enqueue(queue, fine, out.host_fine.size(), 8);
}

}  // namespace kvx
