// Stage `examples_completed`: the example of a scan of which a bone is lost, with what the other scans lead
// to expect near it.
#pragma once
#include <functional>
#include <memory>

#include "pipeline/examples/example_moments.h"
#include "pipeline/runner.h"
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

// The examples of all scans at the voxels of the body; looked at once, when the first scan asks.
class ExampleStack {
 public:
  struct Scan {
    Digest example, shown;                                                   // keys
    std::function<std::shared_ptr<const DisplacementField>()> load_example;  // one is held at a time
    std::function<std::shared_ptr<const Mask>()> load_shown;
  };
  ExampleStack(const Artifact<Mask>& body, std::vector<Scan> scans);

  const std::vector<Scan>& scans() const { return scans_; }
  const std::vector<size_t>& BodyVoxels();
  const std::vector<ExampleSample>& AtBodyVoxels();  // per scan
  void Forget();                                     // until it is asked again

 private:
  void Look();

  const Artifact<Mask>& body_;
  std::vector<Scan> scans_;
  std::vector<size_t> voxels_;
  std::vector<ExampleSample> at_voxels_;
};

struct CompleteExample {
  static constexpr std::string_view kName = "examples_completed";
  static constexpr int kVersion = 4;
  struct Inputs {
    ExampleStack& examples;
    const Artifact<Mask>& body;
    const Artifact<WeightMap>& weights;
    const Artifact<SkeletonFit>& fit;
    const Artifact<ExampleMoments>& moments;
    std::vector<Digest> Keys() const;
  };
  struct Options {
    int scan = 0;  // index as in the stack
  };
  using Output = DisplacementField;  // as the scan's example where it shows the body
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, CompleteExample::Options& v) {
  a(v.scan);
}

}  // namespace kvx
