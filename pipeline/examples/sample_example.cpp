// The same voxels for every example of a body.
#include "pipeline/examples/sample_example.h"

#include <algorithm>

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

SampleExample::Output SampleExample::Run(const Inputs& inputs, const Options&, StageContext&) {
  Output samples;
  for (const size_t v : SampledVoxels(*inputs.body)) samples.push_back(inputs.example->values[v]);
  return samples;
}

}  // namespace kvx
