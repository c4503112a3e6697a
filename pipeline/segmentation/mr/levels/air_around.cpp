// Cortex of a bone that leaves the view is as dark as air and reaches the border, too, but it is thin.
#include "pipeline/segmentation/mr/levels/air_around.h"

#include <optional>

#include "core/host/parallel.h"
#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/gaussian_blur.h"
#include "pipeline/scans/air_level.h"

namespace kvx {
namespace {

constexpr double kAir = 0.12;         // of the way from air to tissue
constexpr double kClearMarrow = 4.0;  // times that
constexpr double kBlurVoxels = 0.6;   // against noise
constexpr double kRadiusMm = 5.0;     // of a ball that fits in air, and in no cortex

}  // namespace

LabelMap AirAround(const Volume& scan, double marrow) {
  LabelMap air(scan.grid);
  Volume smooth = scan;
  GaussianBlur(smooth, Eigen::Vector3d::Constant(kBlurVoxels));
  const std::optional<AirLevel> level = FindAirLevel(smooth, "MR");
  if (!level) return air;
  const double rise = kAir * (level->tissue - level->air);
  if (marrow < level->air + kClearMarrow * rise) return air;
  Mask bright(scan.grid), wide(scan.grid);
  ParallelEach(bright.values.size(),
               [&](size_t v) { bright.values[v] = smooth.values[v] >= level->air + rise; });
  const Volume to_bright = DistanceMapMm(bright);
  ParallelEach(wide.values.size(), [&](size_t v) { wide.values[v] = to_bright.values[v] > kRadiusMm; });
  const Volume to_wide = DistanceMapMm(PiecesAtBorder(wide));
  ParallelEach(air.values.size(), [&](size_t v) { air.values[v] = to_wide.values[v] <= kRadiusMm; });
  return air;
}

}  // namespace kvx
