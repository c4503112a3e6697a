// The device warps the scan onto the template's voxels; the sums run on the host in voxel order, so they
// never vary.
#include "pipeline/measures/measures.h"

#include <limits>
#include <stdexcept>

#include "core/parallel.h"
#include "kernels/warp.h"
#include "pipeline/measures/similarity.h"

namespace kvx {

Measures Measure(Backend& backend, const Volume& template_volume, const Mask& body_dilated,
                 const Volume& scan, const DisplacementField& scan_from_template) {
  if (!(body_dilated.grid == template_volume.grid) || !(scan_from_template.grid == template_volume.grid)) {
    throw std::logic_error("mask and field must lie on the template's grid");
  }
  constexpr float kOutside = std::numeric_limits<float>::lowest();
  const Volume warped = Warp(backend)(scan, scan_from_template, kOutside);
  const ByteScale template_scale = ByteScaleOf(template_volume), scan_scale = ByteScaleOf(scan);
  std::vector<std::vector<IntensityPair>> of_slice(size_t(warped.grid.size.z()));
  const size_t voxels = warped.values.size() / std::max<size_t>(1, of_slice.size());  // of a slice
  ParallelFor(of_slice.size(), [&](size_t k) {
    for (size_t v = k * voxels; v < (k + 1) * voxels; ++v) {
      if (!body_dilated.values[v] || warped.values[v] == kOutside) continue;
      of_slice[k].push_back({template_scale(template_volume.values[v]), scan_scale(warped.values[v])});
    }
  });
  std::vector<IntensityPair> pairs;
  for (const auto& slice : of_slice) pairs.insert(pairs.end(), slice.begin(), slice.end());
  return Similarity(pairs);
}

}  // namespace kvx
