// The last resort against folds: where a map does not keep its orientation, the tissue around is relaxed.
#pragma once
#include "core/host/progress.h"
#include "core/image.h"
#include "pipeline/registration/region/work_region.h"

namespace kvx {

// Determinant at a voxel of the region by central differences
// (one-sided where the template ends), 1 for a rigid motion.
double Determinant(const std::vector<Eigen::Vector3f>& scan_mm, const WorkRegion& region,
                   const Grid& template_grid, const Eigen::Vector3i& voxel);

// Moves tissue until no voxel of the body is folded, or gives up where it is torn too far: folds stay then.
// Bone moves only where two bones lie one inside the other, so that no tissue could part them. Of `progress`
// it asks alone whether to go on.
void Unfold(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region, const Progress& progress,
            std::vector<Eigen::Vector3f>& scan_mm);

}  // namespace kvx
