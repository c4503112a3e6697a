// Sweeps over the blocks of one level: Gauss-Newton steps that must earn their parameters.
#pragma once
#include "core/progress.h"
#include "kernels/backend.h"
#include "kernels/block_level.h"

namespace kvx {

// Improves `field` in place; returns the number of blocks that were given control points.
int64_t RegisterLevel(const BlockLevel& level, Backend& backend, const Progress& progress,
                      std::vector<FieldVector>& field);

}  // namespace kvx
