// Dilation by an exact Euclidean distance.
#include "core/distance_transform.h"
#include "pipeline/measures/measures.h"

namespace kvx {

Mask Dilated(const Mask& mask, double radius_mm) {
  const Image<double> squared_mm = SquaredDistanceMm(mask);
  Mask out(mask.grid);
  const double reach2 = radius_mm * radius_mm * (1 + 1e-9);  // a voxel exactly at the radius belongs to it
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = squared_mm.values[v] <= reach2;
  return out;
}

}  // namespace kvx
