// The lines of voxels along one axis of a grid, for passes that take one axis after the other.
#pragma once
#include <algorithm>

#include "core/grid.h"

namespace kvx {

struct GridLines {
  GridLines(const Grid& grid, int axis)
      : length(grid.size[axis]),
        stride(axis == 0   ? 1
               : axis == 1 ? size_t(grid.size.x())
                           : size_t(grid.size.x()) * size_t(grid.size.y())),
        count(size_t(grid.size[(axis + 1) % 3]) * size_t(grid.size[(axis + 2) % 3])) {}

  // Of a line's voxels, the index in the grid; the others follow `stride` apart.
  size_t First(size_t line) const { return line / stride * stride * size_t(length) + line % stride; }

  int length;  // voxels of each
  size_t stride, count;
};

// Lines along the second axis or the third, in bundles that lie side by side in memory: by themselves, the
// voxels of one share no line of cache, and all may compete for the same few.
struct LinesSideBySide {
  static constexpr size_t kMost = 16;

  LinesSideBySide(const Grid& grid, int axis)
      : lines(grid, axis),
        a_row((lines.stride + kMost - 1) / kMost),
        count(lines.count / lines.stride * a_row) {}

  // Of a bundle's lines, the index in the grid; the others' first voxels follow it.
  size_t First(size_t bundle) const {
    return lines.First(bundle / a_row * lines.stride + bundle % a_row * kMost);
  }
  size_t LinesOf(size_t bundle) const { return std::min(kMost, lines.stride - bundle % a_row * kMost); }

  GridLines lines;
  size_t a_row, count;  // bundles
};

// Calls visit(voxel, the next one) for all that lie beside each other along an axis, axis by axis.
template <class Visit>
void ForEachPair(const Grid& grid, Visit&& visit) {
  for (int axis = 0; axis < 3; ++axis) {
    const size_t stride = GridLines(grid, axis).stride;
    for (size_t v = 0; v + stride < grid.VoxelCount(); ++v)
      if (grid.Ijk(v)[axis] + 1 < grid.size[axis]) visit(v, v + stride);
  }
}

}  // namespace kvx
