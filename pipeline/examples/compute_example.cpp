// Eq. 7 at every voxel of the body and, fading, around it.
#include "pipeline/examples/compute_example.h"

#include "core/blend.h"
#include "core/host/parallel.h"
#include "core/numbers/smooth_step.h"
#include "core/voxels/distance_transform.h"

namespace kvx {
namespace {

constexpr double kFullMm = 2.0;       // the skin's half-filled voxels need the whole displacement
constexpr double kRoundingMm = 1e-3;  // bones move rigidly: what is left there is rounding

Eigen::Vector3f ExampleAt(const VoxelWeights& weights, const PoseVector& pose, const Eigen::Vector3d& v0,
                          const Eigen::Vector3f& u, double fade) {
  const Eigen::Vector3d d = ApplyInverse(Blend(weights, pose), v0 + u.cast<double>()) - v0;
  if (!d.allFinite() || d.norm() < kRoundingMm) return Eigen::Vector3f::Zero();
  return (fade * d).cast<float>();
}

}  // namespace

double ExampleFade(double from_body_mm) {
  return SmoothStep(0, kExampleReachMm - kFullMm, kExampleReachMm - from_body_mm);
}

DisplacementField ComputeExample::Run(const Inputs& inputs, const Options&, StageContext& context) {
  const DisplacementField& scan_from_template = inputs.registered->scan_from_template;
  const Grid& grid = scan_from_template.grid;
  const PoseVector pose = PoseOf(*inputs.fits);
  const Image<double> squared_mm = SquaredDistanceMm(*inputs.body, kExampleReachMm);
  context.progress.Report(kName, 0.2);
  DisplacementField out(grid, Eigen::Vector3f::Zero());
  ParallelFor(size_t(grid.size.z()), [&](size_t k) {
    for (size_t v = grid.Index(0, 0, int(k)); v < grid.Index(0, 0, int(k) + 1); ++v) {
      const double fade = ExampleFade(std::sqrt(squared_mm.values[v]));
      if (fade == 0) continue;
      const Eigen::Vector3d v0 = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
      out.values[v] = ExampleAt(inputs.weights->values[v], pose, v0, scan_from_template.values[v], fade);
    }
  });
  return out;
}

}  // namespace kvx
