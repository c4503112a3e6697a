// A coarse map from the pose back to the template, for clients that pose the template's volume themselves.
#pragma once
#include "core/host/progress.h"
#include "pipeline/posing/posing_engine.h"

namespace kvx {

struct InverseGrid {
  DisplacementField template_from_posed;  // on the posed body's grid, `level` times halved; mm, LPS
  // Of trilinear interpolation in it against the exact map, over tissue. Large where tissue of different
  // places meets (fingers that touch, folds): no continuous map is right there.
  double largest_error_mm = 0, p99_error_mm = 0, mean_error_mm = 0;
};

// Minutes at level 0. Throws Cancelled through `progress`, which it asks and does not tell.
InverseGrid CoarseInverse(const PosingEngine& engine, const Mask& body, const ResolvedPose& pose, int level,
                          const Progress& progress = {});

}  // namespace kvx
