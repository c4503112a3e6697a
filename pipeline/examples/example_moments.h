// Stage `example_moments`: how alike the examples are near every bone. It is all that pose space needs to
// know of them.
#pragma once
#include "pipeline/examples/sample_example.h"

namespace kvx {

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
