// Air that a ball reaches: an opening, by two distance maps.
#include "pipeline/skinning/dark_bone.h"

#include "core/host/parallel.h"
#include "core/voxels/distance_transform.h"

namespace kvx {
namespace {

constexpr double kBallMm = 5;  // in radius; fits in no cortex, nor in a tendon beside it

}  // namespace

Mask WithDarkBone(Mask body, const LabelMap& bones) {
  const auto is_dark_bone = [&](size_t v) { return bones.values[v] != 0 && !body.values[v]; };
  bool any = false;
  for (size_t v = 0; v < body.values.size() && !any; ++v) any = is_dark_bone(v);
  if (!any) return body;
  Mask wide(body.grid);
  const Volume to_body_mm = DistanceMapMm(body);
  ParallelEach(wide.values.size(), [&](size_t v) { wide.values[v] = to_body_mm.values[v] > kBallMm; });
  const Volume to_wide_mm = DistanceMapMm(wide);
  ParallelEach(body.values.size(), [&](size_t v) {
    if (is_dark_bone(v) && to_wide_mm.values[v] > kBallMm) body.values[v] = 1;
  });
  return body;
}

}  // namespace kvx
