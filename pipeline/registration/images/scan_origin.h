// Of two images in one contrast, both of which may begin anywhere: a window of a display cuts off what is
// dark, and another sequence adds to all.
#pragma once
#include <span>

#include "pipeline/registration/images/shading.h"

namespace kvx {

// What the scan reads where the template reads 0: without it, dark and bright tissue differ by as large a
// factor in the scan, after its shading, as in the template. 0 where too few samples say so, and where it is
// no more than noise and misplaced tissue make of none.
double FitScanOrigin(std::span<const ShadingSample> samples);

}  // namespace kvx
