// Template points carried into a scan.
#pragma once
#include "pipeline/model/model.h"

namespace kvx {

// The scan's registered correspondence at template points (map-points --scan):
// stage initialise = eq. 2 alone, as the paper's rows have it, without a bone's border between voxels;
// register = Algorithm 1.
enum class ScanStage { kInitialise, kRegister };
std::vector<PointMm> MapPointsToScan(const Model& model, const std::string& scan, ScanStage stage,
                                     const std::vector<PointMm>& in_template);

}  // namespace kvx
