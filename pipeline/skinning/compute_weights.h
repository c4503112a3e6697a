// Stage `weights`: the volumetric weight map, harmonic in the body, bones as constraints, no bleeding across
// air.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

struct ComputeWeights {
  static constexpr std::string_view kName = "weights";
  static constexpr int kVersion = 4;
  struct Inputs {
    const Artifact<BoneSet>& bones;
    const Artifact<Mask>& body;  // on the template grid
    std::vector<Digest> Keys() const { return {bones.key, body.key}; }
  };
  struct Options {
    double tolerance = 1e-4;  // weights are right to about this
  };
  using Output = WeightMap;  // outside the body: those of the nearest body voxel
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, ComputeWeights::Options& v) {
  a(v.tolerance);
}

}  // namespace kvx
