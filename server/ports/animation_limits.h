// How much one animation over HTTP may be.
#pragma once
#include "core/grid.h"
#include "core/scan.h"

namespace kvx {

// Throws InputError beyond 2000 frames.
void RequireFewFrames(int frames);
// Of volumes on this grid, its resolution halved `level` times. Throws InputError beyond 4 GB, before
// compression.
void RequireFewBytes(const Grid& grid, int level, ScalarType type, int frames);

}  // namespace kvx
