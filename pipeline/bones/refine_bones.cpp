// From found bones to refined ones.
#include "pipeline/bones/refine_bones.h"

#include "pipeline/bones/articulated_fit.h"
#include "pipeline/bones/even_light.h"
#include "pipeline/bones/levels.h"
#include "pipeline/bones/register_bones.h"
#include "pipeline/registration/contrast_map.h"

namespace kvx {
namespace {

constexpr double kMostlyOwn = 0.7;         // skinning weight of tissue that moves with its bone
constexpr double kReachOfThickness = 0.3;  // a refinement that goes farther has left what was found

std::vector<double> ReachMm(const BoneSet& bones, const BoneFits& fits) {
  std::vector<double> reach;
  for (int b = 0; b < bones.size(); ++b) {
    reach.push_back(fits[b].doubtful ? 0.0 : kReachOfThickness * bones.bones[b].box.extent_mm.minCoeff());
  }
  return reach;
}

// How the scan shows the template's greys where bones were found; nothing where a rising line does as well.
std::optional<ContrastMap> ContrastOf(const std::vector<BoneTissue>& tissue, const CubicImage& scan,
                                      const BoneFits& fits) {
  std::vector<float> in_template, in_scan;
  for (size_t b = 0; b < tissue.size(); ++b) {
    if (fits[b].doubtful) continue;
    for (const TissueSample& sample : tissue[b].samples) {
      const PointMm at = fits[b].scan_from_template * PointMm{tissue[b].centre.lps + sample.from_centre_mm};
      double value;
      Eigen::Vector3d gradient;
      if (sample.own_weight < kMostlyOwn || !scan.At(scan.grid().ToVox(at).ijk, value, gradient)) continue;
      in_template.push_back(float(sample.value)), in_scan.push_back(float(value));
    }
  }
  return FitContrast(in_template, in_scan);
}

// The template as the scan would show it, and samples of it.
struct SeenTemplate {
  CubicImage image;
  std::vector<BoneTissue> tissue;
};

SeenTemplate TemplateFor(const RefineBones::Inputs& inputs, const CubicImage& scan) {
  const Volume seen = Normalised(EvenlyLit(*inputs.template_scan));
  const auto sampled = [&](const Volume& volume) {
    const CubicImage image(volume);
    return SeenTemplate{image, SampleTissue(*inputs.bones, image, *inputs.weights)};
  };
  SeenTemplate out = sampled(seen);
  const std::optional<ContrastMap> contrast = ContrastOf(out.tissue, scan, *inputs.fits);
  return contrast ? sampled(Mapped(seen, contrast)) : out;
}

}  // namespace

BoneFits RefineBones::Run(const Inputs& inputs, const Options&, StageContext& context) {
  const BoneSet& bones = *inputs.bones;
  const CubicImage scan(Normalised(EvenlyLit(*inputs.scan)));
  const SeenTemplate seen = TemplateFor(inputs, scan);
  context.progress.Report(kName, 0.3);
  const std::vector<BoneEstimate> estimates =
      FitArticulated(seen.tissue, seen.image, scan, PoseOf(*inputs.fits), ReachMm(bones, *inputs.fits));
  BoneFits out = *inputs.fits;
  for (int b = 0; b < bones.size(); ++b) {
    out[b].scan_from_template = estimates[b].scan_from_template;
    out[b].covariance = estimates[b].covariance;
    out[b].correlation = estimates[b].correlation;
  }
  return out;
}

}  // namespace kvx
