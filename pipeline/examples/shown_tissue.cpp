// Marks what may be wrong, then fades towards it.
#include "pipeline/examples/shown_tissue.h"

#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"
#include "core/voxels/distance_transform.h"
#include "pipeline/examples/joint_relevance.h"
#include "pipeline/measures/similarity.h"

namespace kvx {
namespace {

// Most doubtful bones lie where they should, and the images agree there as they do near sure ones: their
// correlation is not smaller by more than this factor.
constexpr double kAgrees = 0.85;
constexpr double kLostWeight = 0.1;  // of lost bones, from which on tissue goes where they go
constexpr double kFadeVoxels = 4;

using Pairs = std::vector<IntensityPair>;

// Per bone, template and registered scan in the tissue that goes mostly with it, where the images say where
// it lies: not where a program filled the scan up.
std::vector<Pairs> PairsNearBones(const ShownTissue::Inputs& inputs) {
  const Volume &shown = inputs.template_scan->volume, &scan = inputs.scan->volume;
  const DisplacementField& u = inputs.registered->scan_from_template;
  const Mask& error_steps = inputs.registered->place_error_steps;
  const ByteScale of_template = ByteScaleOf(shown), of_scan = ByteScaleOf(scan);
  std::vector<Pairs> out(inputs.fits->size());
  for (size_t v = 0; v < shown.values.size(); ++v) {
    if (!inputs.body->values[v]) continue;
    if (!error_steps.values.empty() && error_steps.values[v] == kPlaceErrorUnknown) continue;
    const Eigen::Vector3d x = shown.grid.ToMm(PointVox{shown.grid.Ijk(v).cast<double>()}).lps;
    const PointVox p = scan.grid.ToVox(PointMm{x + u.values[v].cast<double>()});
    if (scan.grid.Contains(p))
      out[inputs.weights->values[v].bones[0]].push_back(
          {of_template(shown.values[v]), of_scan(SampleTrilinear(scan, p))});
  }
  return out;
}

// Whichever of the images is inverted.
double Agreement(const Pairs& pairs) { return pairs.empty() ? 0.0 : std::abs(Correlation(pairs)); }

// Doubtful bones near which the images do not agree either; all of them where no bone is sure.
std::vector<bool> LostBones(const ShownTissue::Inputs& inputs) {
  const BoneFits& fits = *inputs.fits;
  std::vector<bool> lost(fits.size(), false);
  if (std::ranges::none_of(fits, &BoneFit::Doubtful)) return lost;
  const std::vector<Pairs> pairs = PairsNearBones(inputs);
  double sure = 0, voxels = 0;
  for (size_t b = 0; b < fits.size(); ++b) {
    if (fits[b].Doubtful()) continue;
    sure += double(pairs[b].size()) * Agreement(pairs[b]), voxels += double(pairs[b].size());
  }
  for (size_t b = 0; b < fits.size(); ++b)
    lost[b] = fits[b].Doubtful() && (voxels == 0 || Agreement(pairs[b]) < kAgrees * sure / voxels);
  return lost;
}

// Lost bones, and those near which the tissue's place is known but not the pose that it belongs to: beside a
// joint whose angles a lost bone decides.
std::vector<bool> LostPlaces(const Skeleton& skeleton, const std::vector<bool>& lost) {
  const auto angles_are_lost = [&](int j) {
    const Joint& joint = skeleton.joints[size_t(j)];
    const bool of_lost = lost[size_t(j)] || (joint.parent != kNoParent && lost[size_t(joint.parent)]);
    return of_lost && !joint.dofs.empty();
  };
  std::vector<bool> places = lost;
  for (size_t b = 0; b < places.size(); ++b)
    places[b] = places[b] || std::ranges::any_of(NeighbouringJoints(skeleton, int(b)), angles_are_lost);
  return places;
}

double LostPart(const VoxelWeights& weights, const std::vector<bool>& lost) {
  double part = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (lost[weights.bones[s]]) part += weights.weights[s];
  }
  return part;
}

// 0 near lost bones .. 1 some voxels from there.
Volume AwayFromLost(const ShownTissue::Inputs& inputs) {
  const Mask& body = *inputs.body;
  const std::vector<bool> lost = LostPlaces(inputs.fit->skeleton, LostBones(inputs));
  Volume away(body.grid, 1);
  if (std::ranges::count(lost, true) == 0) return away;
  Mask near_lost(body.grid);
  ParallelEach(body.values.size(), [&](size_t v) {
    near_lost.values[v] = body.values[v] && LostPart(inputs.weights->values[v], lost) > kLostWeight;
  });
  const Volume away_mm = DistanceMapMm(near_lost);
  const double fade_mm = kFadeVoxels * body.grid.spacing_mm.maxCoeff();
  ParallelEach(away.values.size(),
               [&](size_t v) { away.values[v] = float(std::min(1.0, away_mm.values[v] / fade_mm)); });
  return away;
}

}  // namespace

Mask ShownTissue::Run(const Inputs& inputs, const Options&, StageContext&) {
  const Mask& body = *inputs.body;
  const Mask& error_steps = inputs.registered->place_error_steps;
  const Volume away = AwayFromLost(inputs);
  Mask shown(body.grid);
  ParallelEach(body.values.size(), [&](size_t v) {
    if (!body.values[v]) return;
    const bool open = !error_steps.values.empty() && error_steps.values[v] >= kPlaceErrorInDoubt;
    shown.values[v] = uint8_t(std::lround((open ? kCarriedOnPercent : 100) * away.values[v]));
  });
  return shown;
}

}  // namespace kvx
