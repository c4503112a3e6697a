// Who samples linearly, or smooths by the voxel, would blur wide voxels beyond what they show.
#include "pipeline/scans/finer_scan.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "pipeline/scans/cubic_image.h"

namespace kvx {
namespace {

constexpr int kMostTimes = 4;

}  // namespace

Volume AsFineAs(const Volume& scan, double spacing_mm) {
  Eigen::Array3i times = Eigen::Array3i::Ones();
  for (int a = 0; a < 3; ++a)
    times[a] = int(std::clamp(std::lround(scan.grid.spacing_mm[a] / spacing_mm), 1L, long(kMostTimes)));
  if ((times == 1).all()) return scan;
  Grid grid = scan.grid;
  grid.size = (grid.size.array() - 1) * times + 1;
  grid.spacing_mm.array() /= times.cast<double>();
  Volume finer(grid);
  const CubicImage spline(scan);
  const Eigen::Vector3d last = scan.grid.size.cast<double>().array() - 1;
  ParallelRanges(finer.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3d p = grid.Ijk(v).cast<double>().array() / times.cast<double>();
      double value = 0;
      Eigen::Vector3d slope;
      spline.At(p.cwiseMin(last), value, slope);
      finer.values[v] = float(value);
    }
  });
  return finer;
}

}  // namespace kvx
