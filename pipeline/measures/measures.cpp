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
  const Volume warped = Warp(backend)(scan, scan_from_template, body_dilated, kOutside);
  const ByteScale template_scale = ByteScaleOf(template_volume), scan_scale = ByteScaleOf(scan);
  const Eigen::Vector3i& size = warped.grid.size;
  const size_t slices = size_t(size.z()), voxels = size_t(size.x()) * size_t(size.y());  // of a slice
  return Similarity(ParallelCollect<IntensityPair>(slices, [&](std::vector<IntensityPair>& pairs, size_t k) {
    for (size_t v = k * voxels; v < (k + 1) * voxels; ++v) {
      if (warped.values[v] == kOutside) continue;
      pairs.push_back({template_scale(template_volume.values[v]), scan_scale(warped.values[v])});
    }
  }));
}

}  // namespace kvx
