// Stage `examples`: the displacements of one scan in the template frame (eq. 7),
// d_k = (sum_j w_j T_j)^-1 v-hat_k - v_0.
#pragma once
#include "core/registered_scan.h"
#include "pipeline/runner.h"

namespace kvx {

struct ComputeExample {
  static constexpr std::string_view kName = "examples";
  static constexpr int kVersion = 3;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<WeightMap>& weights;
    const Artifact<BoneFits>& fits;
    const Artifact<RegisteredScan>& registered;
    std::vector<Digest> Keys() const { return {body.key, weights.key, fits.key, registered.key}; }
  };
  using Options = NoOptions;
  using Output = DisplacementField;  // d_k on the template grid, mm, template frame; 0 well outside the body
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

constexpr double kExampleReachMm = 10.0;  // air farther from the body has no displacement
// How much of an example is left so far from the body: 1 near it, 0 from its reach on.
double ExampleFade(double from_body_mm);

}  // namespace kvx
