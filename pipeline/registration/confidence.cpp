// Host loops over the body.
#include "pipeline/registration/confidence.h"

#include <cmath>

#include "core/parallel.h"

namespace kvx {
namespace {

size_t Strongest(const VoxelWeights& weights) {
  size_t best = 0;
  for (size_t n = 1; n < weights.weights.size(); ++n)
    if (weights.weights[n] > weights.weights[best]) best = n;
  return weights.bones[best];
}

}  // namespace

Mask ConfidencePercent(const RegisterScan::Inputs& inputs, const Volume& beyond_coat_mm,
                       const WorkRegion& region, const std::vector<float>& cells,
                       const std::vector<Eigen::Vector3f>& scan_mm) {
  const Mask& body = *inputs.body;
  const Grid& scan = inputs.scan->volume.grid;
  const Grid cell_grid = Coarsened(region.grid, 2);
  const double voxel_mm = region.grid.spacing_mm.maxCoeff();
  Mask out(body.grid);
  ParallelRanges(body.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (!body.values[v]) continue;
      const Eigen::Vector3i p = body.grid.Ijk(v) - region.first, c = p / 2;
      const size_t at = region.grid.Index(p.x(), p.y(), p.z());
      if (!scan.Contains(scan.ToVox(PointMm{scan_mm[at].cast<double>()}))) continue;
      const double free = FreedomBesideBone(beyond_coat_mm.values[at], voxel_mm);
      const double bone = (*inputs.fits)[Strongest(inputs.weights->values[v])].doubtful ? 0 : 1;
      const double sure = free * cells[cell_grid.Index(c.x(), c.y(), c.z())] + (1 - free) * bone;
      out.values[v] = uint8_t(std::lround(100 * sure));
    }
  });
  return out;
}

ConfidenceSummary Summarise(const Mask& confidence_percent, const Mask& body) {
  double sum = 0, unsure = 0, count = 0;
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (!body.values[v]) continue;
    count += 1, sum += confidence_percent.values[v], unsure += confidence_percent.values[v] < kUnsurePercent;
  }
  if (count < 1) return {};
  return {sum / count, unsure / count};
}

}  // namespace kvx
