// Displacements between levels, and the map template -> scan that they end in.
#pragma once
#include "core/pose.h"
#include "core/weight_map.h"
#include "kernels/block_level.h"
#include "pipeline/registration/region/work_region.h"

namespace kvx {

// The field of a level on the next finer one (trilinear), held at 0 where the finer level's mobility is 0.
std::vector<FieldVector> Refined(const std::vector<FieldVector>& field, const Grid& coarse,
                                 const BlockLevel& fine);

// start(v + d(v)) in scan mm at every voxel of the region.
std::vector<Eigen::Vector3f> StartAfter(const std::vector<Eigen::Vector3f>& start_mm,
                                        const WorkRegion& region, const std::vector<FieldVector>& field);
// v-hat(v) - v on the weights' grid (eq. 6);
// beyond the region VBD goes on, off by what it is at the region's border.
DisplacementField OnTemplate(const WeightMap& weights, const PoseVector& scan_from_template,
                             const WorkRegion& region, const std::vector<Eigen::Vector3f>& scan_mm);

// Share of the body's voxels where the map x + u(x) does not keep its orientation (central differences).
double FoldedFraction(const DisplacementField& field, const Mask& body);

}  // namespace kvx
