// The same voxels for every example of a body.
#include "pipeline/examples/sample_example.h"

#include <algorithm>

#include "pipeline/examples/shown_tissue.h"

namespace kvx {

std::vector<size_t> SpreadVoxels(const Mask& body, size_t most) {
  const size_t inside =
      size_t(std::count_if(body.values.begin(), body.values.end(), [](uint8_t v) { return v != 0; }));
  const size_t step = std::max<size_t>(1, (inside + most - 1) / most);
  std::vector<size_t> voxels;
  size_t seen = 0;
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (body.values[v] && seen++ % step == 0) voxels.push_back(v);
  }
  return voxels;
}

std::vector<size_t> SampledVoxels(const Mask& body) {
  constexpr size_t kMost = 20000;
  return SpreadVoxels(body, kMost);
}

ExampleSample SampleAt(const std::vector<size_t>& voxels, const DisplacementField& example,
                       const Mask& shown_percent) {
  ExampleSample sample;
  sample.mm.reserve(voxels.size());  // they may be all of a body
  sample.shown_percent.reserve(voxels.size());
  for (const size_t v : voxels) {
    sample.mm.push_back(example.values[v]);
    sample.shown_percent.push_back(shown_percent.values[v]);
  }
  return sample;
}

double HiddenPart(const ExampleSample& sample) {
  const auto hidden = std::ranges::count_if(sample.shown_percent,
                                            [](uint8_t percent) { return percent < kCarriedOnPercent; });
  return double(hidden) / std::max(1.0, double(sample.shown_percent.size()));
}

ExampleSample SampleExample::Run(const Inputs& inputs, const Options&, StageContext&) {
  return SampleAt(SampledVoxels(*inputs.body), *inputs.example, *inputs.shown);
}

}  // namespace kvx
