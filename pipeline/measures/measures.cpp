// The device warps the scan onto the template's voxels; the sums run on the host in voxel order, so they
// never vary.
#include "pipeline/measures/measures.h"

#include <limits>
#include <stdexcept>

#include "core/host/parallel.h"
#include "kernels/warp.h"

namespace kvx {

ComparedImages::ComparedImages(const Volume& of_template, const Volume& of_scan)
    : template_volume(of_template),
      scan(of_scan),
      template_scale(ByteScaleOf(of_template)),
      scan_scale(ByteScaleOf(of_scan)) {}

Measures Measure(Backend& backend, const ComparedImages& images, const Mask& body_dilated,
                 const DisplacementField& scan_from_template) {
  const Grid& grid = images.template_volume.grid;
  if (!(body_dilated.grid == grid) || !(scan_from_template.grid == grid)) {
    throw std::logic_error("mask and field must lie on the template's grid");
  }
  constexpr float kOutside = std::numeric_limits<float>::lowest();
  const Volume warped = Warp(backend)(images.scan, scan_from_template, body_dilated, kOutside);
  const Eigen::Vector3i& size = grid.size;
  const size_t slices = size_t(size.z()), voxels = size_t(size.x()) * size_t(size.y());  // of a slice
  return Similarity(ParallelCollect<IntensityPair>(slices, [&](std::vector<IntensityPair>& pairs, size_t k) {
    for (size_t v = k * voxels; v < (k + 1) * voxels; ++v) {
      if (warped.values[v] == kOutside) continue;
      pairs.push_back(
          {images.template_scale(images.template_volume.values[v]), images.scan_scale(warped.values[v])});
    }
  }));
}

}  // namespace kvx
