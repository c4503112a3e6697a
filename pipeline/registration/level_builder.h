// Prepares template, scan, VBD and bone mask for the block registration,
// from the finest level to coarser ones.
#pragma once
#include <optional>
#include <span>

#include "kernels/block_level.h"
#include "pipeline/registration/register_scan.h"

namespace kvx {

// A box of template voxels around the body, a multiple of 8 voxels wide along every axis;
// may stick out of the template.
struct WorkRegion {
  Eigen::Vector3i first = Eigen::Vector3i::Zero();  // template voxel of the box's voxel 0
  Grid grid;
};
WorkRegion RegionAround(const Mask& body);

// 0 in bone .. 1, where soft tissue moves as the images say.
double FreedomBesideBone(double bone_distance_mm, double voxel_mm);

// Levels from fine to coarse, each half the resolution of the one before. Intensities are in units of the
// noise of their difference, with the scan brought to the template's mean and contrast. `start_mm`: where
// every voxel of the region starts, in scan mm.
std::vector<BlockLevel> BuildLevels(const RegisterScan::Inputs& inputs,
                                    std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region,
                                    Backend& backend);

}  // namespace kvx
