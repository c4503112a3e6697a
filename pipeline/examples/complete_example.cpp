// In the body voxel by voxel; around it as at the nearest voxel of the body.
#include "pipeline/examples/complete_example.h"

#include "core/host/parallel.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/nearest_voxel.h"
#include "pipeline/examples/compute_example.h"
#include "pipeline/examples/expected_example.h"

namespace kvx {

ExampleStack::ExampleStack(const Artifact<Mask>& body, std::vector<Scan> scans)
    : body_(body), scans_(std::move(scans)) {}

void ExampleStack::Look() {
  if (!at_voxels_.empty()) return;
  voxels_ = SpreadVoxels(*body_, body_->values.size());
  for (const Scan& scan : scans_)
    at_voxels_.push_back(SampleAt(voxels_, *scan.load_example(), *scan.load_shown()));
}

const std::vector<size_t>& ExampleStack::BodyVoxels() {
  Look();
  return voxels_;
}

const std::vector<ExampleSample>& ExampleStack::AtBodyVoxels() {
  Look();
  return at_voxels_;
}

void ExampleStack::Forget() {
  voxels_ = {};
  at_voxels_ = {};
}

std::vector<Digest> CompleteExample::Inputs::Keys() const {
  std::vector<Digest> keys{body.key, weights.key, fit.key, moments.key};
  for (const ExampleStack::Scan& scan : examples.scans()) keys.insert(keys.end(), {scan.example, scan.shown});
  return keys;
}

DisplacementField CompleteExample::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const std::vector<size_t>& voxels = inputs.examples.BodyVoxels();
  std::vector<const ExampleSample*> scans;
  for (const ExampleSample& sample : inputs.examples.AtBodyVoxels()) scans.push_back(&sample);
  context.progress.Report(kName, 0.4);
  const PoseSpace space(*inputs.fit, {}, *inputs.moments);
  const std::vector<Eigen::Vector3f> expected =
      ExpectedExamples(scans, voxels, *inputs.weights, space, options.scan);
  context.progress.Report(kName, 0.7);
  DisplacementField out = *inputs.examples.scans()[size_t(options.scan)].load_example();
  const ExampleSample& own = *scans[size_t(options.scan)];
  std::vector<uint32_t> at_voxel(out.values.size());  // where a voxel of the body stands among them
  for (size_t n = 0; n < voxels.size(); ++n) at_voxel[voxels[n]] = uint32_t(n);
  const std::vector<uint32_t> nearest = NearestMarked(*inputs.body);
  const Image<double> squared_mm = SquaredDistanceMm(*inputs.body, kExampleReachMm);
  ParallelEach(out.values.size(), [&](size_t v) {
    const size_t n = at_voxel[nearest[v]];
    const float shown = float(own.shown_percent[n]) / 100.0f;
    const Eigen::Vector3f instead = expected[n] - shown * own.mm[n];  // of what is not shown
    out.values[v] = shown * out.values[v] + float(ExampleFade(std::sqrt(squared_mm.values[v]))) * instead;
  });
  return out;
}

}  // namespace kvx
