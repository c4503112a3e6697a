// Where the start carries the voxels, which of them count and how freely they move.
#include "pipeline/registration/images/level_images.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/numbers/smooth_step.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/finer_grid.h"
#include "pipeline/registration/images/closed_air.h"
#include "pipeline/registration/images/grey_origin.h"
#include "pipeline/registration/images/match_greys.h"
#include "pipeline/registration/images/noise.h"
#include "pipeline/registration/images/start_residual.h"
#include "pipeline/registration/region/landing_box.h"
#include "pipeline/scans/finer_scan.h"

namespace kvx {
namespace {

constexpr double kBesideClosedVoxels = 2;  // smoothing carries the air's darkness that far into the skin
// Beyond a bone's coat, over which soft tissue gains its freedom
constexpr double kBoneMarginVoxels = 1.75;
// Of a scan on finer voxels than its own: half a gigabyte, of which a handful are held. Of wider views only
// what the body may land in is looked at.
constexpr double kMostRefinedVoxels = 1 << 27;
// Of the template (two blocks), over which displacements fade where the scan shows nothing
constexpr double kFadeVoxels = 16;

bool IsFilled(const Mask& corners, const PointMm& at) {
  if (corners.values.empty()) return false;
  const Eigen::Vector3i p = corners.grid.ToVox(at).ijk.array().round().cast<int>();
  return corners.grid.Contains(p) && corners(p.x(), p.y(), p.z());
}

// What a program filled up in either image, and what is beyond the template.
Mask Hidden(const LevelImages& images, std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region) {
  Mask hidden(region.grid);
  ParallelEach(hidden.values.size(), [&](size_t v) {
    const Eigen::Vector3i p = region.grid.Ijk(v);
    hidden.values[v] = !images.template_box.Contains(p + region.first) ||
                       IsFilled(images.template_corners, region.grid.ToMm(p.x(), p.y(), p.z())) ||
                       IsFilled(images.scan_corners, PointMm{start_mm[v].cast<double>()});
  });
  return hidden;
}

// Where the start carries every voxel, in scan voxels; those near the body count, but for air that the pose
// closes and the skin beside it, which shows an edge in the template alone.
void FillMap(std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region, const LevelImages& images,
             const Mask& hidden, BlockLevel& level) {
  const Grid& scan = images.scan.grid;
  const double reach_mm = kWidestRingVoxels * region.grid.spacing_mm.maxCoeff();
  ParallelEach(level.grid.VoxelCount(), [&](size_t v) {
    level.start[v] << scan.ToVox(PointMm{start_mm[v].cast<double>()}).ijk.cast<float>(), 0;
  });
  const double beside_mm = kBesideClosedVoxels * region.grid.spacing_mm.maxCoeff();
  const Volume from_closed_mm = DistanceMapMm(ClosedAir(images.body, level.start, scan), beside_mm);
  ParallelEach(level.weight.size(), [&](size_t v) {
    const bool counts = !hidden.values[v] && from_closed_mm.values[v] > beside_mm &&
                        images.body_distance_mm.values[v] <= reach_mm;
    level.weight[v] = counts ? 1 : 0;  // made an inverse variance later
  });
}

// How deep a voxel lies in the part of the limb that only one of the two scans saw, where VBD puts it; 0 in
// air. As far as mobility fades.
Volume UnseenDepthMm(const Mask& hidden, const BlockLevel& level) {
  Mask seen(hidden.grid, 1);
  ParallelEach(seen.values.size(), [&](size_t v) {
    seen.values[v] = !hidden.values[v] && (level.weight[v] <= 0 || LandsInside(level, level.scan.grid, v));
  });
  return DistanceMapMm(seen, kFadeVoxels * level.grid.spacing_mm.maxCoeff());
}

// None in bone, and fading to none (VBD) where nothing was seen: what a block's spline carries there is
// extrapolation.
void FillMobility(const LevelImages& images, const Volume& unseen_mm, BlockLevel& level) {
  const double voxel_mm = level.grid.spacing_mm.maxCoeff();
  ParallelEach(level.mobility.size(), [&](size_t v) {
    level.mobility[v] = float(FreedomBesideBone(images.beyond_coat_mm.values[v], voxel_mm) *
                              SmoothStep(0, 1, 1 - unseen_mm.values[v] / (kFadeVoxels * voxel_mm)));
  });
}

// How far each image is smoothed, in its voxels. Both are smoothed alike, by the voxel, as what differs in
// sharpness pulls at tissue. Only where both have thick slices is each smoothed over its own: what is read
// between them errs, and not alike in both.
struct Smoothing {
  Eigen::Vector3i of_template = Eigen::Vector3i::Ones(), of_scan = Eigen::Vector3i::Ones();
};

// `template_times`, `scan_times`: voxels in the place of one that was measured.
Smoothing SmoothingOf(const Eigen::Vector3i& template_times, const Eigen::Vector3i& scan_times) {
  if ((template_times.array() == 1).all() || (scan_times.array() == 1).all()) return {};
  return {template_times, scan_times};
}

// The box, smoothed by itself, on the region's grid. Around it are the nearest of its voxels: anything else
// would be an edge at every cut end. `reach` as Pyramid::Smoothed takes it.
Volume SmoothedWithin(const Volume& volume, const VoxelBox& box, const Eigen::Vector3i& reach,
                      const WorkRegion& region, const Pyramid& pyramid) {
  const Volume smooth = pyramid.Smoothed(*Within(volume, box), reach);
  Volume out(region.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
    const Eigen::Vector3i p = smooth.grid.Nearest(region.grid.Ijk(v) + region.first - box.low);
    out.values[v] = smooth(p.x(), p.y(), p.z());
  });
  return out;
}

// In the image that was measured more coarsely; by both, where either shows less along some direction. Where
// programs made more voxels of them, each says what its neighbours say.
double VoxelsAMeasurement(const Grid& region, const LevelImages& images, const ShownPair& shown) {
  const double voxel_mm3 = region.spacing_mm.prod();
  return images.sharing *
         std::max({1.0, double(images.times.prod()), images.measured_scan.grid.spacing_mm.prod() / voxel_mm3,
                   shown.voxel_mm3 / voxel_mm3});
}

}  // namespace

bool ScanShows(const LevelImages& images, const PointMm& in_scan) {
  return images.scan_grid.Contains(images.scan_grid.ToVox(in_scan)) &&
         !IsFilled(images.scan_corners, in_scan);
}

double FreedomBesideBone(double beyond_coat_mm, double voxel_mm) {
  return SmoothStep(0, kBoneMarginVoxels * voxel_mm, beyond_coat_mm);
}

LevelImages PrepareImages(const RegistrationInputs& inputs, const Eigen::Vector3i& times,
                          const Volume& beyond_coat_mm, const WorkRegion& region, const Pyramid& pyramid) {
  const Scan& template_scan = *inputs.template_scan;
  // Between the planes of a filled side that was split there is none of one value.
  const OwnOrLent<Volume> as_measured = EveryVoxelOf(template_scan.volume, times);
  const VoxelBox box = MeasuredBoxOf(*as_measured);
  const OwnOrLent<Volume> of_template = Within(*as_measured, box);
  LevelImages out{.beyond_coat_mm = beyond_coat_mm,
                  .template_box = {box.low.cwiseProduct(times), (box.high.array() - 1) * times.array() + 1},
                  .template_corners = FilledCorners(*of_template, template_scan.modality),
                  .times = times};
  out.template_origin = GreyOriginOf(*of_template, out.template_corners, template_scan.modality);
  out.body = Crop(*inputs.body, region);
  out.body_distance_mm = DistanceMapMm(out.body);
  const OwnOrLent<Volume> measured = Measured(inputs.scan->volume);
  out.scan_grid = measured->grid;
  out.scan_corners = FilledCorners(*measured, inputs.scan->modality);
  const double spacing_mm = out.body.grid.MeanSpacingMm();
  const float scan_origin = GreyOriginOf(*measured, out.scan_corners, inputs.scan->modality);
  out.measured_scan = FromOrigin(AsCoarseAs(*measured, spacing_mm), scan_origin);
  out.sharing = 0.5 * (VoxelsSharingNoise(*as_measured) + VoxelsSharingNoise(out.measured_scan));
  const Eigen::Vector3i scan_times = TimesFiner(out.measured_scan.grid, spacing_mm);
  const Smoothing smoothing = SmoothingOf(times, scan_times);
  out.template_volume = FromOrigin(
      SmoothedWithin(template_scan.volume, out.template_box, smoothing.of_template, region, pyramid),
      out.template_origin);
  const double refined_voxels = double(out.measured_scan.values.size()) * double(scan_times.prod());
  const bool whole = (scan_times.array() == 1).all() || refined_voxels <= kMostRefinedVoxels;
  const OwnOrLent<Volume> seen = whole
                                     ? OwnOrLent<Volume>(out.measured_scan)
                                     : Within(out.measured_scan, LandingBox(inputs, out.measured_scan.grid));
  if (!whole) out.scan_grid = seen->grid;
  out.scan = pyramid.Smoothed(*Finer(*seen, scan_times), smoothing.of_scan);
  return out;
}

BlockLevel EmptyLevel(const Grid& grid) {
  BlockLevel level;
  level.grid = grid;
  const size_t n = grid.VoxelCount();
  level.start = Filled<FieldVector>(n, FieldVector::Zero());
  level.intensity.resize(n);
  level.weight.resize(n);
  level.mobility.resize(n);
  level.stiffness.resize(n / 8);
  level.firmness.resize(n / 8);
  return level;
}

BlockLevel FinestLevel(const RegistrationInputs& inputs, const LevelImages& images,
                       std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region) {
  BlockLevel level = EmptyLevel(region.grid);
  const Mask hidden = Hidden(images, start_mm, region);
  FillMap(start_mm, region, images, hidden, level);
  const Grid template_grid = CoarserGrid(inputs.template_scan->volume.grid, images.times);
  ShownPair shown = ShownAlike(images, template_grid, start_mm);
  level.voxels_a_measurement = VoxelsAMeasurement(region.grid, images, shown);
  MatchGreys(inputs, images, std::move(shown), level);
  FillMobility(images, UnseenDepthMm(hidden, level), level);
  return level;
}

}  // namespace kvx
