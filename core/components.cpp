// Flood fill over 6-neighbours by runs of voxels, in voxel order: the numbering is always the same.
#include "core/components.h"

#include <algorithm>

#include "core/parallel.h"

namespace kvx {
namespace {

// A run of voxels of a mask along i; all of it is of one piece.
struct Run {
  size_t first, end;
};

Run RunAround(const Mask& mask, size_t at) {
  const size_t line = size_t(mask.grid.size.x()), start = at / line * line;
  Run run{at, at + 1};
  while (run.first > start && mask.values[run.first - 1]) --run.first;
  while (run.end < start + line && mask.values[run.end]) ++run.end;
  return run;
}

// Calls visit(index) with where the run would lie in each of the four lines beside its own.
template <class Visit>
void ForEachLineBeside(const Grid& grid, size_t first, Visit&& visit) {
  const Eigen::Vector3i p = grid.Ijk(first);
  size_t stride = size_t(grid.size.x());
  for (int axis = 1; axis < 3; ++axis) {
    if (p[axis] > 0) visit(first - stride);
    if (p[axis] + 1 < grid.size[axis]) visit(first + stride);
    stride *= size_t(grid.size[axis]);
  }
}

size_t Flood(const Mask& mask, size_t seed, int32_t number, Image<int32_t>& piece, std::vector<Run>& open) {
  size_t count = 0;
  const auto take = [&](size_t at) {
    const Run run = RunAround(mask, at);
    std::fill(piece.values.begin() + run.first, piece.values.begin() + run.end, number);
    count += run.end - run.first;
    open.push_back(run);
    return run.end;
  };
  take(seed);
  while (!open.empty()) {
    const Run run = open.back();
    open.pop_back();
    ForEachLineBeside(mask.grid, run.first, [&](size_t first) {
      const size_t end = first + (run.end - run.first);
      for (size_t v = first; v < end; ++v) {
        if (mask.values[v] && piece.values[v] < 0) v = take(v);  // the voxel after a run is not in the mask
      }
    });
  }
  return count;
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

Mask FillEnclosed(const Mask& mask) { return Complement(PiecesAtBorder(Complement(mask))); }

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

Mask Complement(const Mask& mask) {
  Mask out(mask.grid);
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = !mask.values[v]; });
  return out;
}

Components LabelComponents(const Mask& mask) {
  Components out{Image<int32_t>(mask.grid, -1), {}};
  std::vector<Run> open;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (!mask.values[v] || out.piece.values[v] >= 0) continue;
    out.voxels.push_back(Flood(mask, v, int32_t(out.voxels.size()), out.piece, open));
  }
  return out;
}

std::vector<uint8_t> PiecesWith(const Components& pieces, const Mask& some) {
  std::vector<uint8_t> with(pieces.voxels.size(), 0);
  for (size_t v = 0; v < some.values.size(); ++v) {
    if (some.values[v] && pieces.piece.values[v] >= 0) with[pieces.piece.values[v]] = 1;
  }
  return with;
}

Mask MaskOf(const Components& pieces, const std::vector<uint8_t>& chosen) {
  Mask out(pieces.piece.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
    out.values[v] = pieces.piece.values[v] >= 0 && chosen[pieces.piece.values[v]];
  });
  return out;
}

Mask PiecesAtBorder(const Mask& mask) {
  const Components pieces = LabelComponents(mask);
  std::vector<uint8_t> at_border(pieces.voxels.size(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    if (mask.grid.size[axis] == 1) continue;
    for (const int slice : {0, mask.grid.size[axis] - 1}) {
      for (const size_t v : FaceVoxels(mask.grid, axis, slice))
        if (mask.values[v]) at_border[pieces.piece.values[v]] = 1;
    }
  }
  return MaskOf(pieces, at_border);
}

Mask KeepLargePieces(const Mask& mask, double fraction) {
  const Components pieces = LabelComponents(mask);
  if (pieces.voxels.empty()) return mask;
  const double least = fraction * double(*std::max_element(pieces.voxels.begin(), pieces.voxels.end()));
  std::vector<uint8_t> large;
  for (const size_t voxels : pieces.voxels) large.push_back(double(voxels) >= least);
  return MaskOf(pieces, large);
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
