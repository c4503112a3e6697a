// Flood fill over 6-neighbours, in voxel order: the numbering is the same in every run.
#include "pipeline/skinning/components.h"

#include <algorithm>

namespace kvx {
namespace {

template <class Visit>
void ForEachNeighbour(const Grid& grid, size_t at, Visit&& visit) {
  const Eigen::Vector3i p = grid.Ijk(at);
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] > 0) visit(at - stride);
    if (p[axis] + 1 < grid.size[axis]) visit(at + stride);
    stride *= size_t(grid.size[axis]);
  }
}

size_t Flood(const Mask& mask, size_t seed, int32_t number, Image<int32_t>& piece,
             std::vector<size_t>& open) {
  size_t count = 0;
  open.assign(1, seed);
  piece.values[seed] = number;
  while (!open.empty()) {
    const size_t at = open.back();
    open.pop_back();
    ++count;
    ForEachNeighbour(mask.grid, at, [&](size_t next) {
      if (!mask.values[next] || piece.values[next] >= 0) return;
      piece.values[next] = number;
      open.push_back(next);
    });
  }
  return count;
}

// Along an axis of one voxel there is no border: the mask is a slice.
bool OnBorder(const Grid& grid, size_t at) {
  const Eigen::Vector3i p = grid.Ijk(at);
  for (int axis = 0; axis < 3; ++axis) {
    if (grid.size[axis] > 1 && (p[axis] == 0 || p[axis] + 1 == grid.size[axis])) return true;
  }
  return false;
}

Mask FillEnclosed(const Mask& mask) {
  Mask gaps(mask.grid);
  for (size_t v = 0; v < gaps.values.size(); ++v) gaps.values[v] = !mask.values[v];
  const Components pieces = LabelComponents(gaps);
  std::vector<uint8_t> open(pieces.voxels.size(), 0);
  for (size_t v = 0; v < gaps.values.size(); ++v) {
    if (gaps.values[v] && OnBorder(mask.grid, v)) open[pieces.piece.values[v]] = 1;
  }
  Mask filled = mask;
  for (size_t v = 0; v < gaps.values.size(); ++v) {
    if (gaps.values[v] && !open[pieces.piece.values[v]]) filled.values[v] = 1;
  }
  return filled;
}

// The voxels of one border slice, in memory order.
std::vector<size_t> FaceVoxels(const Grid& grid, int axis, int slice) {
  Eigen::Vector3i from = Eigen::Vector3i::Zero(), to = grid.size;
  from[axis] = slice, to[axis] = slice + 1;
  std::vector<size_t> voxels;
  for (int k = from.z(); k < to.z(); ++k) {
    for (int j = from.y(); j < to.y(); ++j) {
      for (int i = from.x(); i < to.x(); ++i) voxels.push_back(grid.Index(i, j, k));
    }
  }
  return voxels;
}

void FillFace(int axis, int slice, Mask& mask) {
  Grid face_grid = mask.grid;
  face_grid.size[axis] = 1;
  const std::vector<size_t> voxels = FaceVoxels(mask.grid, axis, slice);
  Mask face(face_grid);
  for (size_t n = 0; n < voxels.size(); ++n) face.values[n] = mask.values[voxels[n]];
  face = FillEnclosed(face);
  for (size_t n = 0; n < voxels.size(); ++n) mask.values[voxels[n]] = face.values[n];
}

}  // namespace

Components LabelComponents(const Mask& mask) {
  Components out{Image<int32_t>(mask.grid, -1), {}};
  std::vector<size_t> open;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (!mask.values[v] || out.piece.values[v] >= 0) continue;
    out.voxels.push_back(Flood(mask, v, int32_t(out.voxels.size()), out.piece, open));
  }
  return out;
}

Mask KeepLargePieces(const Mask& mask, double fraction) {
  const Components pieces = LabelComponents(mask);
  if (pieces.voxels.empty()) return mask;
  const double least = fraction * double(*std::max_element(pieces.voxels.begin(), pieces.voxels.end()));
  Mask out(mask.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    out.values[v] = mask.values[v] && double(pieces.voxels[pieces.piece.values[v]]) >= least;
  }
  return out;
}

Mask FillHoles(const Mask& mask) {
  Mask closed = mask;
  for (int axis = 0; axis < 3; ++axis) {
    if (mask.grid.size[axis] < 2) continue;
    FillFace(axis, 0, closed);
    FillFace(axis, mask.grid.size[axis] - 1, closed);
  }
  return FillEnclosed(closed);
}

}  // namespace kvx
