// Cell by cell on the host; disagreement is looked at over the 27 cells around each.
#include "pipeline/registration/images/place_information.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "pipeline/registration/images/disagreement.h"
#include "pipeline/registration/images/shown_voxels.h"
#include "pipeline/registration/images/usual_residual.h"

namespace kvx {
namespace {

// Per mm, by differences over a voxel of the scan.
Eigen::Vector3f SlopeAt(const Volume& scan, const Eigen::Matrix3d& vox_from_mm, const PointVox& p) {
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    const PointVox lo{p.ijk - 0.5 * Eigen::Vector3d::Unit(a)}, hi{p.ijk + 0.5 * Eigen::Vector3d::Unit(a)};
    if (scan.grid.Contains(lo) && scan.grid.Contains(hi))
      slope[a] = SampleTrilinear(scan, hi) - SampleTrilinear(scan, lo);
  }
  return (vox_from_mm.transpose() * slope).cast<float>();
}

Eigen::Matrix3f OfCell(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm,
                       const Eigen::Vector3i& first) {
  const Eigen::Matrix3d vox_from_mm = level.scan.grid.VoxFromMm();
  Eigen::Matrix3f out = Eigen::Matrix3f::Zero();
  ForEachShown(level, scan_mm, first, [&](size_t v, const PointVox& p) {
    const Eigen::Vector3f slope = SlopeAt(level.scan, vox_from_mm, p);
    out += level.weight[v] / 8 * slope * slope.transpose();
  });
  return out;
}

}  // namespace

std::vector<Eigen::Matrix3f> PlaceInformation(const BlockLevel& level,
                                              std::span<const Eigen::Vector3f> scan_mm) {
  const Grid cells = Coarsened(level.grid, 2);
  const std::vector<float> disagreement = DisagreementBeside(level, scan_mm);
  std::vector<Eigen::Matrix3f> out(cells.VoxelCount());
  ParallelEach(out.size(), [&](size_t c) {
    out[c] =
        OfCell(level, scan_mm, 2 * cells.Ijk(c)) / std::max(1.0f, disagreement[c] / float(kUsualResidual));
  });
  return out;
}

}  // namespace kvx
