// Stage `example_moments`: how alike the examples are near every bone. It is all that pose space needs to
// know of them.
#pragma once
#include "pipeline/examples/sample_example.h"
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

// Per bone, scans x scans, mm^2: the mean of d_k d_l along an axis, over the body by the bone's weight.
struct ExampleMoments {
  std::vector<Eigen::MatrixXd> of_bones;
  Eigen::MatrixXi hidden;  // bones x scans, 1 where the scan shows next to nothing there; empty: shown

  bool Hides(size_t bone, int scan) const { return hidden.size() > 0 && hidden(Eigen::Index(bone), scan); }
  // Scans that show what lies near a bone, in order; `scans`: how many there are.
  std::vector<int> ShownNear(size_t bone, int scans) const;
  Eigen::VectorXd KnownNear(size_t bone, int scans) const;  // 1 of those that do, 0 of others
  ExampleMoments Without(int scan) const;
};
template <class A>
void Fields(A& a, ExampleMoments& v) {
  a(v.of_bones);
  a.AtTheEnd(v.hidden);  // of version 2 of the stage
}

// Of the examples as they are expected to be where scans do not show them (expected_example.h), which itself
// takes moments: turn by turn.
struct CompareExamples {
  static constexpr std::string_view kName = "example_moments";
  static constexpr int kVersion = 4;
  struct Inputs {
    const Artifact<Mask>& body;
    const Artifact<WeightMap>& weights;
    const Artifact<SkeletonFit>& fit;
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
