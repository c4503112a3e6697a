// CPU twin of kernels/harmonic.h.
#pragma once
#include "kernels/harmonic.h"

namespace kvx::reference {

// `sweeps` red-black sweeps, in place.
void HarmonicSweeps(const HarmonicGraph& graph, const std::vector<float>& anchors, float omega, int sweeps,
                    std::vector<float>& fields);

}  // namespace kvx::reference
