// CPU twin of kernels/bone_scores.h.
#pragma once
#include "kernels/bone_scores.h"

namespace kvx::reference {

std::vector<CorrelationSums> BoneScores(const Volume& scan, std::span<const BoneSample> samples,
                                        std::span<const VoxFromSample> candidates);

}  // namespace kvx::reference
