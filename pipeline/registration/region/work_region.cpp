// Grid arithmetic.
#include "pipeline/registration/region/work_region.h"

#include "core/errors.h"

namespace kvx {

WorkRegion RegionAround(const Mask& body, int multiple) {
  Eigen::Vector3i lo = body.grid.size, hi = Eigen::Vector3i::Constant(-1);
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (!body.values[v]) continue;
    const Eigen::Vector3i p = body.grid.Ijk(v);
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  if (hi.x() < 0) throw InputError("the template shows no body to register; check its intensities");
  WorkRegion region;
  region.first = lo - Eigen::Vector3i::Constant(kBlockVoxels);
  region.grid = body.grid;
  region.grid.size = ((hi - region.first).array() + 1 + kBlockVoxels + multiple - 1) / multiple * multiple;
  region.grid.origin = body.grid.ToMm(PointVox{region.first.cast<double>()});
  return region;
}

}  // namespace kvx
