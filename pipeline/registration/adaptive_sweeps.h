// Sweeps over the blocks of one level: Gauss-Newton steps that must earn their parameters.
#pragma once
#include "core/progress.h"
#include "kernels/backend.h"
#include "kernels/block_level.h"
#include "pipeline/registration/block_solver.h"

namespace kvx {

struct LevelOutcome {
  int64_t blocks = 0;  // that were given control points
  // Where asked for: per cell, of what the images say alone; nothing known where no block is.
  std::vector<PlaceCertainty> certainty;
};

// Improves `field` in place.
LevelOutcome RegisterLevel(const BlockLevel& level, Backend& backend, const Progress& progress,
                           bool with_certainty, std::vector<FieldVector>& field);

}  // namespace kvx
