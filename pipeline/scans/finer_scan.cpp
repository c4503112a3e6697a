// Who samples linearly, or smooths by the voxel, would blur wide voxels beyond what they show.
#include "pipeline/scans/finer_scan.h"

#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"
#include "core/voxels/cubic_spline.h"
#include "core/voxels/finer_grid.h"
#include "pipeline/scans/coarser.h"

namespace kvx {

OwnOrLent<Volume> Finer(const Volume& scan, const Eigen::Vector3i& times) {
  if ((times.array() == 1).all()) return scan;
  const Grid grid = FinerGrid(scan.grid, times);
  Volume finer(grid);
  const Volume spline = SplineCoefficients(scan);
  const Eigen::Vector3d last = scan.grid.size.cast<double>().array() - 1;
  ParallelEach(finer.values.size(), [&](size_t v) {
    const Eigen::Vector3i at = grid.Ijk(v), whole = at.cwiseQuotient(times);
    if (whole.cwiseProduct(times) == at && scan.grid.Contains(whole)) {
      finer.values[v] = scan(whole.x(), whole.y(), whole.z());  // to the bit: filled planes stay of one value
      return;
    }
    const Eigen::Vector3d p = at.cast<double>().cwiseQuotient(times.cast<double>());
    finer.values[v] = SampleSpline(spline, PointVox{p.cwiseMin(last)});
  });
  return finer;
}

Volume AsCoarseAs(const Volume& scan, double spacing_mm) {
  Eigen::Vector3i voxels;
  for (int a = 0; a < 3; ++a) {
    voxels[a] =
        int(std::clamp<long>(std::lround(spacing_mm / scan.grid.spacing_mm[a]), 1,
                             std::max(1, scan.grid.size[a] / 2)));  // two planes at least, for splines
  }
  const Eigen::Vector3i whole_blocks = scan.grid.size.cwiseQuotient(voxels).cwiseProduct(voxels);
  return Coarser(scan, {{Eigen::Vector3i::Zero(), whole_blocks}, voxels});
}

Volume AsFineAs(Volume scan, double spacing_mm) {
  OwnOrLent<Volume> finer = Finer(scan, TimesFiner(scan.grid, spacing_mm));
  return finer.lent() ? std::move(scan) : std::move(finer).Taken();
}

}  // namespace kvx
