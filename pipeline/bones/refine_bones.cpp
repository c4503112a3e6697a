// From found bones to refined ones.
#include "pipeline/bones/refine_bones.h"

#include "pipeline/bones/articulated_fit.h"
#include "pipeline/bones/levels.h"
#include "pipeline/bones/register_bones.h"

namespace kvx {
namespace {

constexpr double kReachOfThickness = 0.3;  // a refinement that goes farther has left what was found

std::vector<double> ReachMm(const BoneSet& bones, const BoneFits& fits) {
  std::vector<double> reach;
  for (int b = 0; b < bones.size(); ++b) {
    reach.push_back(fits[b].doubtful ? 0.0 : kReachOfThickness * bones.bones[b].box.extent_mm.minCoeff());
  }
  return reach;
}

}  // namespace

BoneFits RefineBones::Run(const Inputs& inputs, const Options&, StageContext& context) {
  const BoneSet& bones = *inputs.bones;
  const CubicImage scan(Normalised(inputs.scan->volume));
  const std::vector<BoneTissue> tissue =
      SampleTissue(bones, CubicImage(Normalised(inputs.template_scan->volume)), *inputs.weights);
  context.progress.Report(kName, 0.3);
  const std::vector<BoneEstimate> estimates =
      FitArticulated(tissue, scan, PoseOf(*inputs.fits), ReachMm(bones, *inputs.fits));
  BoneFits out = *inputs.fits;
  for (int b = 0; b < bones.size(); ++b) {
    out[b].scan_from_template = estimates[b].scan_from_template;
    out[b].covariance = estimates[b].covariance;
    out[b].correlation = estimates[b].correlation;
  }
  return out;
}

}  // namespace kvx
