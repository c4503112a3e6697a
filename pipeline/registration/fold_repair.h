// The last resort against folds: where a map does not keep its orientation, the tissue around is relaxed.
#pragma once
#include <optional>

#include "core/image.h"
#include "pipeline/registration/elastic_relaxation.h"
#include "pipeline/registration/level_builder.h"

namespace kvx {

// Determinant at a voxel of the region by central differences (one-sided where the template ends), 1 for a rigid
// motion.
double Determinant(const std::vector<Eigen::Vector3f>& scan_mm, const WorkRegion& region, const Grid& template_grid,
                   const Eigen::Vector3i& voxel);

// Moves tissue, never bone, until no voxel of the body is folded, or for as long as that helps.
void Unfold(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region,
            std::vector<Eigen::Vector3f>& scan_mm);

}  // namespace kvx
