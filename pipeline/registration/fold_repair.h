// The last resort against folds: where a map does not keep its orientation, the tissue around is relaxed.
#pragma once
#include <optional>

#include "core/image.h"
#include "pipeline/registration/work_region.h"

namespace kvx {

// The least determinant at a voxel of the region, 1 for a rigid motion: by central differences (one-sided
// where the template ends), and at the corners of the cells around it whose edges there lie in the body.
double LeastDeterminant(const std::vector<Eigen::Vector3f>& scan_mm, const Mask& body,
                        const WorkRegion& region, const Eigen::Vector3i& voxel);

// Moves tissue until no voxel of the body is folded. Bone moves only where two bones lie one inside the
// other, so that no tissue could part them.
void Unfold(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region,
            std::vector<Eigen::Vector3f>& scan_mm);

}  // namespace kvx
