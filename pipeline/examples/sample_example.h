// Stage `example_samples`: an example at some voxels, small enough to hold those of all scans at once.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

// At most `most` voxels of the body, spread evenly in memory order.
std::vector<size_t> SpreadVoxels(const Mask& body, size_t most);
// Those at which the stage looks.
std::vector<size_t> SampledVoxels(const Mask& body);

// d_k of one scan at the spread voxels of the body.
struct SampleExample {
  static constexpr std::string_view kName = "example_samples";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<DisplacementField>& example;
    std::vector<Digest> Keys() const { return {body.key, example.key}; }
  };
  using Options = NoOptions;
  using Output = std::vector<Eigen::Vector3f>;  // mm, template frame
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
