// The air around the body in an MR scan: no bone lies there, however dark its cortex is.
#pragma once
#include "core/image.h"

namespace kvx {

// 1: dark places at the border of the view that are wider than cortex ever is. None where the scan shows no
// air, or where marrow as dim as `marrow` can hardly be told from it (fat-suppressed scans).
LabelMap AirAround(const Volume& scan, double marrow);

}  // namespace kvx
