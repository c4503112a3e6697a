// Stage `example_shown`: where a scan says what its example is, and where it does not.
#pragma once
#include "core/pose.h"
#include "core/registered_scan.h"
#include "pipeline/runner.h"
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

// Beyond the view, or where the images leave tissue's place open, the registration carries on from where it
// is known and from bones: its error is about a third of the displacement.
constexpr uint8_t kCarriedOnPercent = 90;

struct ShownTissue {
  static constexpr std::string_view kName = "example_shown";
  static constexpr int kVersion = 4;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<WeightMap>& weights;
    const Artifact<BoneFits>& fits;  // of this scan
    const Artifact<SkeletonFit>& fit;
    const Artifact<RegisteredScan>& registered;
    const Artifact<Scan>& template_scan;  // in the key of what was registered, as the scan
    const Artifact<Scan>& scan;
    std::vector<Digest> Keys() const { return {body.key, weights.key, fits.key, fit.key, registered.key}; }
  };
  using Options = NoOptions;
  // Per cent, on the template's grid: how much an example says of what the tissue does at its pose (its error
  // is 1 / share - 1 of the displacement's variance). 0 outside the body, and near bones that are lost or
  // stand at angles that are, rising to 100 within a few voxels; kCarriedOnPercent where the scan does not
  // show it.
  using Output = Mask;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
