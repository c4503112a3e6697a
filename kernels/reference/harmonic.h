// CPU twin of kernels/harmonic.h.
#pragma once
#include "kernels/harmonic.h"

namespace kvx::reference {

// One cycle, in place, from level `level` on. `drive`: of that level, laid out as its fields.
void HarmonicCycle(const HarmonicLevels& levels, const std::vector<float>& drive, std::vector<float>& fields,
                   size_t level = 0);

}  // namespace kvx::reference
