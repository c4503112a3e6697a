// Block means of volumes.
#include "pipeline/bones/images/levels.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/grid_lines.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

Grid CoarsenedGrid(const Grid& grid, const Eigen::Vector3i& factor) {
  Grid out = grid;
  // An incomplete block at the end is left out
  out.size = (grid.size.array() / factor.array()).max(1).matrix();
  out.spacing_mm = grid.spacing_mm.cwiseProduct(factor.cast<double>());
  out.origin = grid.ToMm(PointVox{0.5 * (factor.cast<double>().array() - 1.0).matrix()});
  return out;
}

float BlockMean(const Volume& volume, const Eigen::Vector3i& low, const Eigen::Vector3i& factor) {
  const Eigen::Vector3i high = (low + factor).cwiseMin(volume.grid.size);
  double sum = 0;
  int count = 0;
  ForEachVoxel(VoxelBox{low, high},
               [&](const Eigen::Vector3i& p) { sum += volume(p.x(), p.y(), p.z()), ++count; });
  return float(sum / std::max(1, count));
}

struct Counted {
  double sum = 0;
  size_t count = 0;
  Counted& operator+=(const Counted& other) {
    sum += other.sum, count += other.count;
    return *this;
  }
};

// Linear along an axis, at the voxels that a finer grid of the same axes has there; constant beyond the ends.
Volume Stretched(const Volume& volume, int axis, const Grid& finer) {
  const Grid& grid = volume.grid;
  const double ahead_mm = (grid.direction.transpose() * (grid.origin.lps - finer.origin.lps))[axis];
  Grid stretched = grid;
  stretched.size[axis] = finer.size[axis];
  stretched.spacing_mm[axis] = finer.spacing_mm[axis];
  stretched.origin.lps -= ahead_mm * grid.direction.col(axis);
  const size_t size = size_t(finer.size[axis]), stride = GridLines(grid, axis).stride;
  const int last = grid.size[axis] - 1;
  Volume out(stretched);
  ParallelEach(out.values.size() / stride, [&](size_t row) {
    const double at_mm = double(row % size) * finer.spacing_mm[axis] - ahead_mm;
    const double at = std::clamp(at_mm / grid.spacing_mm[axis], 0.0, double(last));
    const int low = int(at), high = std::min(low + 1, last);
    const float part = float(at - low);
    const float* from = volume.values.data() + row / size * size_t(last + 1) * stride;
    for (size_t n = 0; n < stride; ++n) {
      const float a = from[size_t(low) * stride + n], b = from[size_t(high) * stride + n];
      out.values[row * stride + n] = a + part * (b - a);
    }
  });
  return out;
}

}  // namespace

Volume Normalised(Volume volume) {
  std::vector<float>& values = volume.values;
  const Counted sums = ParallelSum<Counted>(values.size(), [&](Counted& part, size_t v) {
    if (std::isfinite(values[v])) part.sum += values[v], ++part.count;
  });
  const double count = double(std::max<size_t>(1, sums.count)), mean = sums.sum / count;
  const double squares = ParallelSum<double>(values.size(), [&](double& part, size_t v) {
    if (std::isfinite(values[v])) part += (values[v] - mean) * (values[v] - mean);
  });
  const double sd = std::sqrt(squares / count), scale = sd > 0 ? 1 / sd : 1;
  ParallelEach(values.size(), [&](size_t v) {
    values[v] = std::isfinite(values[v]) ? float((values[v] - mean) * scale) : 0.0f;
  });
  return volume;
}

Volume CoarsenedTo(const Volume& volume, double voxel_mm) {
  const Eigen::Vector3i factor = (voxel_mm / volume.grid.spacing_mm.array())
                                     .round()
                                     .cast<int>()
                                     .max(1)
                                     .matrix()
                                     .cwiseMin(volume.grid.size);
  Volume out(CoarsenedGrid(volume.grid, factor));
  ParallelEach(out.values.size(), [&](size_t v) {
    out.values[v] = BlockMean(volume, out.grid.Ijk(v).cwiseProduct(factor), factor);
  });
  return out;
}

Volume OnFinerGrid(Volume volume, const Grid& finer) {
  for (int axis = 0; axis < 3; ++axis) volume = Stretched(volume, axis, finer);
  return volume;
}

std::vector<Volume> MakeLevels(const Volume& volume, const std::vector<double>& voxel_mm) {
  std::vector<Volume> levels;
  levels.push_back(Normalised(volume));
  for (const double mm : voxel_mm) levels.push_back(CoarsenedTo(levels[0], mm));
  return levels;
}

}  // namespace kvx
