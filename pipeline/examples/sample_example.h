// Stage `example_samples`: an example at some voxels, small enough to hold those of all scans at once.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

// At most `most` voxels of the body, spread evenly in memory order.
std::vector<size_t> SpreadVoxels(const Mask& body, size_t most);
// Those at which the stage looks.
std::vector<size_t> SampledVoxels(const Mask& body);

// An example at some voxels of the body, in their order.
struct ExampleSample {
  std::vector<Eigen::Vector3f> mm;  // template frame
  std::vector<uint8_t> shown_percent;
};
template <class A>
void Fields(A& a, ExampleSample& v) {
  a(v.mm, v.shown_percent);
}
ExampleSample SampleAt(const std::vector<size_t>& voxels, const DisplacementField& example,
                       const Mask& shown_percent);
// Part of the sample of which the example says less than what the registration carries on.
double HiddenPart(const ExampleSample& sample);

// d_k of one scan at the spread voxels of the body.
struct SampleExample {
  static constexpr std::string_view kName = "example_samples";
  static constexpr int kVersion = 2;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<DisplacementField>& example;
    const Artifact<Mask>& shown;  // as ShownTissue says
    std::vector<Digest> Keys() const { return {body.key, example.key, shown.key}; }
  };
  using Options = NoOptions;
  using Output = ExampleSample;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
