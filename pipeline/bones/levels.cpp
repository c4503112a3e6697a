// Block means of volumes.
#include "pipeline/bones/levels.h"

#include "core/parallel.h"

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
  for (int k = low.z(); k < high.z(); ++k) {
    for (int j = low.y(); j < high.y(); ++j) {
      for (int i = low.x(); i < high.x(); ++i) sum += volume(i, j, k), ++count;
    }
  }
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

}  // namespace

Volume Normalised(const Volume& volume) {
  const std::vector<float>& values = volume.values;
  const Counted sums = ParallelSum<Counted>(values.size(), [&](Counted& part, size_t v) {
    if (std::isfinite(values[v])) part.sum += values[v], ++part.count;
  });
  const double count = double(std::max<size_t>(1, sums.count)), mean = sums.sum / count;
  const double squares = ParallelSum<double>(values.size(), [&](double& part, size_t v) {
    if (std::isfinite(values[v])) part += (values[v] - mean) * (values[v] - mean);
  });
  const double sd = std::sqrt(squares / count), scale = sd > 0 ? 1 / sd : 1;
  Volume out(volume.grid);
  ParallelEach(values.size(), [&](size_t v) {
    out.values[v] = std::isfinite(values[v]) ? float((values[v] - mean) * scale) : 0.0f;
  });
  return out;
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

std::vector<Volume> MakeLevels(const Volume& volume, const std::vector<double>& voxel_mm) {
  std::vector<Volume> levels{Normalised(volume)};
  for (const double mm : voxel_mm) levels.push_back(CoarsenedTo(levels[0], mm));
  return levels;
}

}  // namespace kvx
