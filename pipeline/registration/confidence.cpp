// Host loops over the body.
#include "pipeline/registration/confidence.h"

#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "pipeline/bones/register_bones.h"
#include "pipeline/registration/blend_table.h"
#include "pipeline/skeleton/bone_certainty.h"

namespace kvx {
namespace {

// Beside what the images leave open, tissue is the less sure the farther it is from where the bones alone
// would put it: what the prior and the linear images do not know grows with the way.
constexpr double kErrorPerMoved = 0.07;
// Two of three errors are within so many standard deviations (root of the covariance's trace). For normal
// errors it would be 1.1. Read from phantoms of two generators: docs/results.md, "How sure".
constexpr double kDeviations = 1.2;

uint8_t Steps(double error_mm) {
  const double steps = std::ceil(error_mm / kPlaceErrorStepMm);
  return steps < kPlaceErrorUnknown ? uint8_t(steps) : kPlaceErrorUnknown;  // also where it is not a number
}

}  // namespace

SurenessMaps Sureness(const RegisterScan::Inputs& inputs, const Volume& beyond_coat_mm,
                      const WorkRegion& region, const std::vector<PlaceCertainty>& cells,
                      const std::vector<Eigen::Vector3f>& scan_mm) {
  const Mask& body = *inputs.body;
  const Grid& scan = inputs.scan->volume.grid;
  const Grid cell_grid = Coarsened(region.grid, 2);
  const double voxel_mm = region.grid.spacing_mm.maxCoeff();
  const PoseVector pose = PoseOf(*inputs.fits);
  const BlendTable skinned(pose);
  SurenessMaps out{Mask(body.grid), Mask(body.grid, kPlaceErrorUnknown)};
  ParallelEach(body.values.size(), [&](size_t v) {
    if (!body.values[v]) return;
    const Eigen::Vector3i p = body.grid.Ijk(v) - region.first, c = p / 2;
    const size_t at = region.grid.Index(p.x(), p.y(), p.z());
    if (!scan.Contains(scan.ToVox(PointMm{scan_mm[at].cast<double>()}))) return;
    const VoxelWeights& weights = inputs.weights->values[v];
    const size_t b = weights.bones[0];  // the largest weight is the first
    const BoneFit& bone = (*inputs.fits)[b];
    const PlaceCertainty& images = cells[cell_grid.Index(c.x(), c.y(), c.z())];
    const double free = FreedomBesideBone(beyond_coat_mm.values[at], voxel_mm);
    const double sure = free * images.share + (1 - free) * (bone.Doubtful() ? 0 : 1);
    out.confidence_percent.values[v] = uint8_t(std::lround(100 * sure));
    if (bone.Doubtful()) return;  // the images may fit another tissue well
    const Eigen::Vector3d x = body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}).lps;
    const double moved_mm = (scan_mm[at].cast<double>() - Apply(skinned(weights), x)).norm();
    const double way_mm = kErrorPerMoved * moved_mm;
    const double variance = (free > 0 ? free * (images.variance_mm2 + way_mm * way_mm) : 0) +
                            (1 - free) * PlaceVarianceMm2(bone, x - inputs.bones->bones[b].centroid.lps);
    out.place_error_steps.values[v] = Steps(kDeviations * std::sqrt(variance));
  });
  return out;
}

Volume PlaceErrorMm(const Mask& place_error_steps) {
  Volume out(place_error_steps.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const uint8_t steps = place_error_steps.values[v];
    out.values[v] = steps == kPlaceErrorUnknown ? std::numeric_limits<float>::quiet_NaN()
                                                : float(kPlaceErrorStepMm * steps);
  }
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
