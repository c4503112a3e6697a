// Block means of volumes.
#include "pipeline/bones/levels.h"

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

}  // namespace

Volume Normalised(const Volume& volume) {
  double sum = 0, squares = 0;
  size_t count = 0;
  for (const float v : volume.values) {
    if (std::isfinite(v)) sum += v, ++count;
  }
  const double mean = sum / double(std::max<size_t>(1, count));
  for (const float v : volume.values) {
    if (std::isfinite(v)) squares += (v - mean) * (v - mean);
  }
  const double sd = std::sqrt(squares / double(std::max<size_t>(1, count)));
  const double scale = sd > 0 ? 1 / sd : 1;
  Volume out(volume.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    out.values[v] = std::isfinite(volume.values[v]) ? float((volume.values[v] - mean) * scale) : 0.0f;
  }
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
  for (size_t v = 0; v < out.values.size(); ++v) {
    out.values[v] = BlockMean(volume, out.grid.Ijk(v).cwiseProduct(factor), factor);
  }
  return out;
}

std::vector<Volume> MakeLevels(const Volume& volume, const std::vector<double>& voxel_mm) {
  std::vector<Volume> levels{Normalised(volume)};
  for (const double mm : voxel_mm) levels.push_back(CoarsenedTo(levels[0], mm));
  return levels;
}

}  // namespace kvx
