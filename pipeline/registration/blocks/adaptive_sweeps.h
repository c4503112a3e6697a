// Sweeps over the blocks of one level: Gauss-Newton steps that must earn their parameters.
#pragma once
#include <limits>

#include "core/host/progress.h"
#include "kernels/block_level.h"
#include "kernels/device/backend.h"
#include "pipeline/registration/blocks/block_solver.h"

namespace kvx {

constexpr float kNotKnown = std::numeric_limits<float>::infinity();

struct LevelOutcome {
  int64_t blocks = 0;  // that were given control points
  // Where asked for: per cell, of the displacement, as images and prior leave it; kNotKnown where no block
  // is.
  std::vector<float> variances_mm2;
};

struct SweepCounts {
  int most = 0;
  int wide = 0;  // of these, the first ones: blocks twice as wide take their turn before the others
};

// Improves `field` in place: alternately on the lattice and on the one shifted by
// half a block.
LevelOutcome RegisterLevel(const BlockLevel& level, Backend& backend, const Progress& progress,
                           const SweepCounts& sweeps, bool with_variances, std::vector<FieldVector>& field);

}  // namespace kvx
