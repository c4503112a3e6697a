// Every row is combined with those beside it, whole rows at a time.
#include "core/voxels/dilated.h"

#include <array>

#include "core/host/parallel.h"
#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"

namespace kvx {
namespace {

template <class Combine>
void CombineRows(const uint8_t* beside, size_t count, Combine combine, uint8_t* row) {
  for (size_t i = 0; i < count; ++i) row[i] = combine(row[i], beside[i]);
}

// Each voxel with its six neighbours.
template <class Combine>
Mask WithNeighbours(const Mask& mask, Combine combine) {
  Mask out = mask;
  const Eigen::Vector3i size = mask.grid.size;
  const size_t length = size_t(size.x());
  const std::array<size_t, 3> strides{1, length, length * size_t(size.y())};
  ParallelEach(size_t(size.y()) * size_t(size.z()), [&](size_t r) {
    const Eigen::Vector3i p(0, int(r % size_t(size.y())), int(r / size_t(size.y())));
    const uint8_t* const in = mask.values.data() + r * length;
    uint8_t* const row = out.values.data() + r * length;
    CombineRows(in, length - 1, combine, row + 1);
    CombineRows(in + 1, length - 1, combine, row);
    for (int axis = 1; axis < 3; ++axis) {
      if (p[axis] > 0) CombineRows(in - strides[axis], length, combine, row);
      if (p[axis] + 1 < size[axis]) CombineRows(in + strides[axis], length, combine, row);
    }
  });
  return out;
}

}  // namespace

Mask Dilated(const Mask& mask) {
  return WithNeighbours(mask, [](uint8_t a, uint8_t b) { return uint8_t(a | b); });
}

Mask Eroded(const Mask& mask) {
  return WithNeighbours(mask, [](uint8_t a, uint8_t b) { return uint8_t(a & b); });
}

Mask Dilated(const Mask& mask, double radius_mm) {
  const Image<double> squared_mm = SquaredDistanceMm(mask, radius_mm);
  Mask out(mask.grid);
  const double reach2 = radius_mm * radius_mm * (1 + 1e-9);  // a voxel exactly at the radius belongs to it
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = squared_mm.values[v] <= reach2; });
  return out;
}

Mask Eroded(const Mask& mask, double radius_mm) { return Complement(Dilated(Complement(mask), radius_mm)); }

}  // namespace kvx
