// Who samples linearly, or smooths by the voxel, would blur wide voxels beyond what they show.
#include "pipeline/scans/finer_scan.h"

#include <algorithm>
#include <cmath>

#include "core/finer_grid.h"
#include "core/parallel.h"
#include "pipeline/scans/cubic_image.h"

namespace kvx {
namespace {

// Means over so many voxels along each axis; what is left over at the ends is left out.
Volume Pooled(const Volume& scan, const Eigen::Vector3i& voxels) {
  if ((voxels.array() == 1).all()) return scan;
  Grid grid = scan.grid;
  grid.size = scan.grid.size.cwiseQuotient(voxels).cwiseMax(1);
  grid.spacing_mm.array() *= voxels.array().cast<double>();
  const Eigen::Vector3d middle = 0.5 * (voxels.cast<double>().array() - 1);
  grid.origin = scan.grid.ToMm(PointVox{middle});
  Volume pooled(grid);
  ParallelRanges(pooled.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3i first = grid.Ijk(v).cwiseProduct(voxels);
      double sum = 0;
      for (int k = 0; k < voxels.z(); ++k) {
        for (int j = 0; j < voxels.y(); ++j) {
          for (int i = 0; i < voxels.x(); ++i) sum += scan(first.x() + i, first.y() + j, first.z() + k);
        }
      }
      pooled.values[v] = float(sum / voxels.prod());
    }
  });
  return pooled;
}

}  // namespace

Volume Finer(const Volume& scan, const Eigen::Vector3i& times) {
  if ((times.array() == 1).all()) return scan;
  const Grid grid = FinerGrid(scan.grid, times);
  Volume finer(grid);
  const CubicImage spline(scan);
  const Eigen::Vector3d last = scan.grid.size.cast<double>().array() - 1;
  ParallelRanges(finer.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3d p = grid.Ijk(v).cast<double>().cwiseQuotient(times.cast<double>());
      double value = 0;
      Eigen::Vector3d slope;
      spline.At(p.cwiseMin(last), value, slope);
      finer.values[v] = float(value);
    }
  });
  return finer;
}

Volume AsCoarseAs(const Volume& scan, double spacing_mm) {
  Eigen::Vector3i voxels;
  for (int a = 0; a < 3; ++a)
    voxels[a] =
        int(std::clamp<long>(std::lround(spacing_mm / scan.grid.spacing_mm[a]), 1, scan.grid.size[a]));
  return Pooled(scan, voxels);
}

Volume AsFineAs(const Volume& scan, double spacing_mm) {
  return Finer(scan, TimesFiner(scan.grid, spacing_mm));
}

}  // namespace kvx
