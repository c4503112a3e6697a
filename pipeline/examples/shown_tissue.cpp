// Marks what is not known, then fades towards it.
#include "pipeline/examples/shown_tissue.h"

#include <algorithm>
#include <cmath>

#include "core/distance_transform.h"
#include "core/parallel.h"
#include "pipeline/registration/confidence.h"

namespace kvx {
namespace {

constexpr double kDoubtfulWeight = 0.1;  // of such bones, from which on tissue goes where they go
constexpr double kFadeVoxels = 4;

// Bones that may lie elsewhere, and those near which the tissue's place is known but not the pose that it
// belongs to: beside a joint whose angles such a bone decides.
std::vector<bool> DoubtfulPlaces(const Skeleton& skeleton, const BoneFits& fits) {
  const size_t count = skeleton.joints.size();
  const auto doubtful = [&](int bone) { return bone != kNoParent && fits[size_t(bone)].doubtful; };
  std::vector<bool> joint(count), place(count);
  for (size_t j = 0; j < count; ++j) {
    joint[j] = !skeleton.joints[j].dofs.empty() && (doubtful(int(j)) || doubtful(skeleton.joints[j].parent));
  }
  for (size_t j = 0; j < count; ++j) {
    place[j] = place[j] || fits[j].doubtful || joint[j];
    for (const int driver : skeleton.joints[j].drivers) place[j] = place[j] || joint[size_t(driver)];
    const int parent = skeleton.joints[j].parent;
    if (joint[j] && parent != kNoParent) place[size_t(parent)] = true;
  }
  return place;
}

double DoubtfulPart(const VoxelWeights& weights, const std::vector<bool>& doubtful) {
  double part = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (doubtful[weights.bones[s]]) part += weights.weights[s];
  }
  return part;
}

}  // namespace

Mask ShownTissue::Run(const Inputs& inputs, const Options&, StageContext&) {
  const Mask& body = *inputs.body;
  const Mask& error_steps = inputs.registered->place_error_steps;
  const std::vector<bool> doubtful = DoubtfulPlaces(inputs.fit->skeleton, *inputs.fits);
  Mask unknown(body.grid);
  ParallelEach(body.values.size(), [&](size_t v) {
    const bool lost = !error_steps.values.empty() && error_steps.values[v] == kPlaceErrorUnknown;
    unknown.values[v] =
        body.values[v] && (lost || DoubtfulPart(inputs.weights->values[v], doubtful) > kDoubtfulWeight);
  });
  const Volume away_mm = DistanceMapMm(unknown);
  const double fade_mm = kFadeVoxels * body.grid.spacing_mm.maxCoeff();
  Mask shown(body.grid);
  ParallelEach(body.values.size(), [&](size_t v) {
    if (body.values[v])
      shown.values[v] = uint8_t(std::lround(100 * std::min(1.0, away_mm.values[v] / fade_mm)));
  });
  return shown;
}

}  // namespace kvx
