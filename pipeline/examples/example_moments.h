// Stages `example_samples` and `example_moments`: how alike the examples are near every bone. It is all that
// pose space needs to know of them.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

// At most `most` voxels of the body, spread evenly in memory order.
std::vector<size_t> SpreadVoxels(const Mask& body, size_t most);

// d_k of one scan at the spread voxels of the body: small enough to hold those of all scans at once.
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

// Per bone, scans x scans, mm^2: the mean of d_k d_l along an axis, over the body by the bone's weight.
struct ExampleMoments {
  std::vector<Eigen::MatrixXd> of_bones;

  ExampleMoments Without(int scan) const;
};
template <class A>
void Fields(A& a, ExampleMoments& v) {
  a(v.of_bones);
}

struct CompareExamples {
  static constexpr std::string_view kName = "example_moments";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<WeightMap>& weights;
    const std::vector<Artifact<SampleExample::Output>>& samples;  // of every scan but the template
    std::vector<Digest> Keys() const;
  };
  struct Options {
    int bones = 0;
  };
  using Output = ExampleMoments;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, CompareExamples::Options& v) {
  a(v.bones);
}

}  // namespace kvx
