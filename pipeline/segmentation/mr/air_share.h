// How much of each voxel at the body's surface is air.
#pragma once
#include "core/image.h"

namespace kvx {

// `air`: 1 where there is nothing else for sure (air_around.h). From there on air goes up to half the
// brightness of what is usual under the surface. 0 everywhere where there is none.
Volume AirShares(const Volume& scan, const LabelMap& air);

}  // namespace kvx
