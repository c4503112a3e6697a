// Grids whose axes run in another order or direction: the same voxels at the same places in the world.
#pragma once
#include "core/image.h"

namespace kvx {

// The grid's voxels with i running to the right as nearly as an axis does, j to the front and k up, as in
// most NIfTI files. Where two axes are as near, the one stored first counts.
Grid RightFrontUp(const Grid& grid);

// The offset of voxel (0, 0, 0) of `grid` in `stored`, which has the same voxels, and what a step along each
// of its axes adds.
struct StoredSteps {
  int64_t first = 0, i = 0, j = 0, k = 0;
};
StoredSteps StepsIn(const Grid& stored, const Grid& grid);

// The image in the order of `grid`, which has the same voxels.
template <class T>
Image<T> InOrderOf(const Grid& grid, const Image<T>& image) {
  const StoredSteps steps = StepsIn(image.grid, grid);
  Image<T> out(grid);
  size_t v = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      int64_t from = steps.first + k * steps.k + j * steps.j;
      for (int i = 0; i < grid.size.x(); ++i, from += steps.i) out.values[v++] = image.values[size_t(from)];
    }
  }
  return out;
}

}  // namespace kvx
