// From found bones to refined ones.
#include "pipeline/bones/refine_bones.h"

#include <cmath>

#include "pipeline/bones/images/even_light.h"
#include "pipeline/bones/images/levels.h"
#include "pipeline/bones/judge/another_size.h"
#include "pipeline/bones/judge/doubt_bone.h"
#include "pipeline/bones/judge/unlike_parts.h"
#include "pipeline/bones/refine/articulated_fit.h"
#include "pipeline/bones/refine/refine_bone.h"
#include "pipeline/scans/contrast_map.h"
#include "pipeline/scans/measured_box.h"

namespace kvx {
namespace {

constexpr double kMostlyOwn = 0.7;         // skinning weight of tissue that moves with its bone
constexpr double kReachOfThickness = 0.3;  // a refinement that goes farther has left what was found

std::vector<double> ReachMm(const BoneSet& bones) {
  std::vector<double> reach;
  for (const Bone& bone : bones.bones) reach.push_back(kReachOfThickness * bone.box.extent_mm.minCoeff());
  return reach;
}

std::vector<bool> InDoubt(const BoneFits& fits) {
  std::vector<bool> in_doubt;
  for (const BoneFit& fit : fits) in_doubt.push_back(fit.Doubtful());
  return in_doubt;
}

// How the scan shows the template's greys where bones were found; nothing where a rising line does as well.
std::optional<ContrastMap> ContrastOf(const std::vector<BoneTissue>& tissue, const CubicImage& scan,
                                      const BoneFits& fits) {
  GreyPairs pairs;
  for (size_t b = 0; b < tissue.size(); ++b) {
    if (fits[b].Doubtful()) continue;
    for (const TissueSample& sample : tissue[b].samples) {
      const PointMm at = fits[b].scan_from_template * PointMm{tissue[b].centre.lps + sample.from_centre_mm};
      double value;
      Eigen::Vector3d gradient;
      if (sample.own_weight < kMostlyOwn || !scan.At(scan.grid().ToVox(at).ijk, value, gradient)) continue;
      pairs.Add(float(sample.value), float(value));
    }
  }
  return FitContrast(pairs);
}

// Of a bone that the scan hardly shows: turned in any way, and some of its lengths away.
Twist6Covariance CovarianceOutOfView(const Bone& bone) {
  Twist6Covariance out = Twist6Covariance::Zero();
  out.diagonal().head<3>().setConstant(std::pow(0.5 * kPi, 2));
  out.diagonal().tail<3>().setConstant(std::pow(bone.box.extent_mm.maxCoeff(), 2));
  return out;
}

void Take(const Bone& bone, const BoneEstimate& estimate, BoneFit& fit) {
  const bool out_of_view = fit.Doubtful() && estimate.seen < kSeenPart;
  if (!out_of_view) fit.scan_from_template = estimate.scan_from_template;
  fit.covariance = out_of_view ? CovarianceOutOfView(bone) : estimate.covariance;
  fit.correlation = estimate.correlation;
  if (estimate.left_reach && !fit.Doubtful())
    DoubtBone(fit, "looked at voxel by voxel, the bone fits better beside the place where it was found");
}

void WeighHints(const BoneSet& bones, const PoseHints& hints, BoneFits& fits) {
  for (const auto& [name, hint] : hints) {
    const int b = bones.IndexOf(name);
    BoneFit& fit = fits[size_t(b)];
    if (!IsNearHint(bones.bones[size_t(b)], hint, fit.scan_from_template)) continue;
    WeighHint(bones.bones[size_t(b)], hint, fit);
    TellOfHint(fit);
  }
}

}  // namespace

BoneFits RefineBones::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const BoneSet& bones = *inputs.shown.bones();
  const CubicImage scan(Normalised(EvenlyLit(*Measured(*inputs.scan))));
  const SeenTemplate& seen = inputs.shown.Seen();
  const std::optional<ContrastMap> contrast = ContrastOf(seen.tissue, scan, *inputs.fits);
  context.progress.Report(kName, 0.3);
  std::optional<SeenTemplate> mapped;
  if (contrast)
    mapped.emplace(bones, Mapped(Normalised(inputs.shown.Lit()), contrast), *inputs.shown.weights());
  const SeenTemplate& alike = mapped ? *mapped : seen;
  const std::vector<BoneEstimate> estimates = FitArticulated(
      alike.tissue, alike.image, scan, PoseOf(*inputs.fits), ReachMm(bones), InDoubt(*inputs.fits));
  BoneFits out = *inputs.fits;
  for (int b = 0; b < bones.size(); ++b) Take(bones.bones[b], estimates[b], out[b]);
  WeighHints(bones, options.initial_poses, out);
  NameUnlikeParts(bones, alike.tissue, scan, out);
  NameAnotherSize(bones, alike, scan, out);
  return out;
}

}  // namespace kvx
