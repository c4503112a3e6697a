// Algorithm 1 as published: the worst block first, until none is beyond the tolerance, level by level.
#pragma once
#include "core/host/progress.h"
#include "pipeline/registration/paper/paper_level.h"
#include "pipeline/registration/paper/paper_options.h"

namespace kvx {

struct PaperRegistration {
  VoxelShifts shifts;                             // D on the scan's grid: V^s is read at p + D(p)
  std::vector<int64_t> control_points_per_level;  // 8 for every block that was optimised
};

// Reports the level, blocks done and expected, and the time they will take at the pace of their levels.
PaperRegistration RegisterAsPublished(const PaperPair& pair, const PaperOptions& options, Backend& backend,
                                      const Progress& progress);

}  // namespace kvx
