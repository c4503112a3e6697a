// One axis after the other.
#include "pipeline/segmentation/mr/search/refined.h"

namespace kvx {
namespace {

Grid RefinedAlong(int axis, const Grid& grid) {
  Grid fine = grid;
  fine.size[axis] = 2 * grid.size[axis] - 1;
  fine.spacing_mm[axis] = grid.spacing_mm[axis] / 2;
  return fine;
}

// between(at, step, n): the value half way from index `at` to at + step, where n is the place of `at` on its
// line.
template <class T, class Between>
Image<T> RefinedAlong(int axis, const Image<T>& image, Between&& between) {
  Image<T> fine(RefinedAlong(axis, image.grid));
  const Eigen::Vector3i unit = Eigen::Vector3i::Unit(axis);
  const size_t step = image.grid.Index(unit.x(), unit.y(), unit.z());
  for (size_t v = 0; v < fine.values.size(); ++v) {
    Eigen::Vector3i p = fine.grid.Ijk(v);
    const bool on_voxel = p[axis] % 2 == 0;
    p[axis] /= 2;
    const size_t at = image.grid.Index(p.x(), p.y(), p.z());
    fine.values[v] = on_voxel ? image.values[at] : between(at, step, p[axis]);
  }
  return fine;
}

Volume RefinedAlong(int axis, const Volume& volume) {
  const int last = volume.grid.size[axis] - 1;
  return RefinedAlong(axis, volume, [&](size_t at, size_t step, int n) {
    const float a = volume.values[at], b = volume.values[at + step];
    const float before = n > 0 ? volume.values[at - step] : a;
    const float after = n + 1 < last ? volume.values[at + 2 * step] : b;
    return (9 * (a + b) - before - after) / 16;
  });
}

LabelMap RefinedAlong(int axis, const LabelMap& strokes) {
  return RefinedAlong(axis, strokes, [&](size_t at, size_t step, int) {
    return strokes.values[at] == strokes.values[at + step] ? strokes.values[at] : uint16_t(0);
  });
}

}  // namespace

Grid Refined(const Grid& grid) { return RefinedAlong(2, RefinedAlong(1, RefinedAlong(0, grid))); }
Volume Refined(const Volume& volume) { return RefinedAlong(2, RefinedAlong(1, RefinedAlong(0, volume))); }
LabelMap Refined(const LabelMap& strokes) {
  return RefinedAlong(2, RefinedAlong(1, RefinedAlong(0, strokes)));
}

}  // namespace kvx
