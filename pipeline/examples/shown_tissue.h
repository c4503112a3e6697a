// Stage `example_shown`: where a scan says what its example is. Elsewhere it is what the registration carries
// on.
#pragma once
#include "core/pose.h"
#include "pipeline/registration/register_scan.h"
#include "pipeline/runner.h"
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

struct ShownTissue {
  static constexpr std::string_view kName = "example_shown";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<WeightMap>& weights;
    const Artifact<BoneFits>& fits;  // of this scan
    const Artifact<SkeletonFit>& fit;
    const Artifact<RegisteredScan>& registered;
    std::vector<Digest> Keys() const { return {body.key, weights.key, fits.key, fit.key, registered.key}; }
  };
  using Options = NoOptions;
  // Per cent, on the template's grid: 0 outside the body, where tissue lies beyond the scan's view or its place
  // is unknown, and near bones that are doubtful or stand at angles that are; 100 from a few voxels within the
  // rest on.
  using Output = Mask;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
