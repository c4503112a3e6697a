// The images that all levels of one registration are made of, and its finest level.
#pragma once
#include <span>

#include "kernels/block_level.h"
#include "kernels/pyramid.h"
#include "pipeline/registration/region/registration_inputs.h"
#include "pipeline/registration/region/work_region.h"
#include "pipeline/scans/filled_corners.h"
#include "pipeline/scans/measured_box.h"

namespace kvx {

// At the template's own resolution, on the region's grid; the scan on its own, or one about as fine, or
// a part of such a one where it would be too large.
struct LevelImages {
  const Volume& beyond_coat_mm;
  VoxelBox template_box;                // measured; in the template's voxels
  Mask template_corners, scan_corners;  // filled up; on the images' own grids, or empty
  Mask body;
  Volume body_distance_mm;
  float template_origin = 0;     // of the greys as they came
  Volume template_volume, scan;  // smoothed, from their origins
  Grid scan_grid;                // of the scan as it came, without sides that were filled up
  Volume measured_scan;   // what was measured of it, also from there, on voxels no finer than the template's
  Eigen::Vector3i times;  // voxels of the template in the place of one that was measured
  double sharing = 1;     // measured voxels that share their noise, mean of the two
};
// `beyond_coat_mm`: as BeyondBoneCoatMm gives it; referred to.
LevelImages PrepareImages(const RegistrationInputs& inputs, const Eigen::Vector3i& times,
                          const Volume& beyond_coat_mm, const WorkRegion& region, const Pyramid& pyramid);

// Not beyond its view, and not where a program filled it up.
bool ScanShows(const LevelImages& images, const PointMm& in_scan);

// Of the template's voxels, around the body: the widest ring that a level counts
constexpr double kWidestRingVoxels = 6;

// 0 in bone and its coat .. 1, where soft tissue moves as the images say.
double FreedomBesideBone(double beyond_coat_mm, double voxel_mm);

// A level with nothing in it.
BlockLevel EmptyLevel(const Grid& grid);

// Intensities are in units of the noise of their difference, with the scan brought to the template's mean and
// contrast. `weight` is 1 where a voxel counts. `start_mm`: where every voxel of the region starts, in scan
// mm.
BlockLevel FinestLevel(const RegistrationInputs& inputs, const LevelImages& images,
                       std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region);

}  // namespace kvx
