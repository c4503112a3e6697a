// A grid of twice as many samples an axis: a bone a few voxels thick is looked for between the voxels, too.
#pragma once
#include "core/image.h"

namespace kvx {

// Sample 2 n lies on voxel n; between them lies one more. The field of voxel centres stays the same.
Grid Refined(const Grid& grid);
// Cubic between voxels (Catmull-Rom), exact on them.
Volume Refined(const Volume& volume);
// A sample between two voxels of one label has it, too: a stroke stays a line.
LabelMap Refined(const LabelMap& strokes);

// What lies on the voxels.
template <class T>
Image<T> OnVoxels(const Image<T>& refined, const Grid& grid) {
  Image<T> out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = 2 * grid.Ijk(v);
    out.values[v] = refined(p.x(), p.y(), p.z());
  }
  return out;
}

}  // namespace kvx
