// Air that a ball reaches is an opening of all that is no body.
#include "pipeline/skinning/dark_bone.h"

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"

namespace kvx {
namespace {

constexpr double kBallMm = 5;  // in radius; fits in no cortex, nor in a tendon beside it

}  // namespace

Mask WithDarkBone(Mask body, const LabelMap& bones) {
  const auto is_dark_bone = [&](size_t v) { return bones.values[v] != 0 && !body.values[v]; };
  bool any = false;
  for (size_t v = 0; v < body.values.size() && !any; ++v) any = is_dark_bone(v);
  if (!any) return body;
  const Mask air = Dilated(Eroded(Complement(body), kBallMm), kBallMm);
  for (size_t v = 0; v < body.values.size(); ++v)
    if (is_dark_bone(v) && !air.values[v]) body.values[v] = 1;
  return body;
}

}  // namespace kvx
