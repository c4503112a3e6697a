// One pass over the pairs of neighbours along each axis.
#include "pipeline/segmentation/dilated.h"

namespace kvx {
namespace {

// Calls visit(index, index of the next voxel along an axis).
template <class Visit>
void ForEachPair(const Grid& grid, Visit&& visit) {
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const size_t slab = stride * size_t(grid.size[axis]);
    for (size_t first = 0; first < grid.VoxelCount(); first += slab) {
      for (size_t v = first; v + stride < first + slab; ++v) visit(v, v + stride);
    }
    stride = slab;
  }
}

}  // namespace

Mask Dilated(const Mask& mask) {
  Mask out = mask;
  ForEachPair(mask.grid,
              [&](size_t a, size_t b) { out.values[a] |= mask.values[b], out.values[b] |= mask.values[a]; });
  return out;
}

Mask Eroded(const Mask& mask) {
  Mask out = mask;
  ForEachPair(mask.grid,
              [&](size_t a, size_t b) { out.values[a] &= mask.values[b], out.values[b] &= mask.values[a]; });
  return out;
}

}  // namespace kvx
