// Stage `measures`: how alike the template carried into a scan's pose and the scan are, before and after
// (paper, Tables 2 to 4).
#pragma once
#include "core/registered_scan.h"
#include "pipeline/runner.h"

namespace kvx {

struct MeasureScan {
  static constexpr std::string_view kName = "measures";
  static constexpr int kVersion = 9;
  struct Inputs {
    const Artifact<Scan>& template_scan;
    const Artifact<Mask>& region;
    const Artifact<WeightMap>& weights;
    const Artifact<BoneFits>& fits;
    const Artifact<Scan>& scan;
    const Artifact<RegisteredScan>& registered;
    std::vector<Digest> Keys() const {
      return {template_scan.key, region.key, weights.key, fits.key, scan.key, registered.key};
    }
  };
  using Options = NoOptions;
  struct Output {
    std::map<std::string, Measures>
        by_stage;  // "source" (no motion), "initialise" (eq. 2), "register" (Algorithm 1)
    int64_t control_points = 0;
    std::vector<int64_t> control_points_per_level;  // coarse to fine
    double folded_fraction = 0;
    ConfidenceSummary confidence;
  };
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};
template <class A>
void Fields(A& a, MeasureScan::Output& v) {
  a(v.by_stage, v.control_points, v.control_points_per_level, v.folded_fraction, v.confidence);
}

}  // namespace kvx
