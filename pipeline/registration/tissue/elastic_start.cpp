// Skinning at every voxel, then the tissue's own equilibrium.
#include "pipeline/registration/tissue/elastic_start.h"

#include "core/host/parallel.h"
#include "pipeline/registration/region/blend_table.h"

namespace kvx {
namespace {

std::vector<Eigen::Vector3f> Skinned(const WeightMap& weights, const PoseVector& pose,
                                     const WorkRegion& region) {
  const BlendTable blend(pose);
  std::vector<Eigen::Vector3f> out(region.grid.VoxelCount());
  ParallelEach(out.size(), [&](size_t v) {
    const Eigen::Vector3i at = region.grid.Ijk(v) + region.first;
    const Eigen::Vector3i p = weights.grid.Nearest(at);
    const Eigen::Vector3d x = weights.grid.ToMm(at.x(), at.y(), at.z()).lps;
    out[v] = Apply(blend(weights(p.x(), p.y(), p.z())), x).cast<float>();
  });
  return out;
}

}  // namespace

std::vector<Eigen::Vector3f> ElasticStart(const WeightMap& weights, const ElasticTissue& tissue,
                                          const PoseVector& scan_from_template, const WorkRegion& region,
                                          const Progress& progress) {
  std::vector<Eigen::Vector3f> scan_mm = Skinned(weights, scan_from_template, region);
  tissue.Relax({}, progress, scan_mm);
  return scan_mm;
}

}  // namespace kvx
