// By samples within each voxel: between voxels, half way up from nothing to skin is where skin begins.
#include "pipeline/segmentation/mr/air_share.h"

#include <algorithm>
#include <optional>

#include "core/distance_transform.h"
#include "core/parallel.h"
#include "core/quantile.h"
#include "core/sample_clamped.h"

namespace kvx {
namespace {

constexpr double kNearVoxels = 1.5;                    // from air that is sure, of more of it
constexpr double kUnderFrom = 1.5, kUnderUntil = 2.5;  // the same, of what is all body
constexpr int kAlong = 4;                              // samples of a voxel along an axis

// The median between two distances from air, in voxels.
std::optional<double> BrightnessUnder(const Volume& scan, const Volume& from_air_mm) {
  const double voxel_mm = scan.grid.MeanSpacingMm();
  std::vector<float> under;
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const double voxels = from_air_mm.values[v] / voxel_mm;
    if (voxels > kUnderFrom && voxels <= kUnderUntil) under.push_back(scan.values[v]);
  }
  if (under.empty()) return std::nullopt;
  return TakeMedian(under);
}

float ShareBelow(double level, const Volume& scan, size_t v) {
  constexpr int kSamples = kAlong * kAlong * kAlong;
  const Eigen::Vector3d centre = scan.grid.Ijk(v).cast<double>();
  int below = 0;
  for (int n = 0; n < kSamples; ++n) {
    const Eigen::Array3d place(n % kAlong, n / kAlong % kAlong, n / (kAlong * kAlong));
    const Eigen::Vector3d offset = (place + 0.5) / kAlong - 0.5;
    below += SampleClamped(scan, PointVox{centre + offset}) < level;
  }
  return float(below) / kSamples;
}

}  // namespace

Volume AirShares(const Volume& scan, const LabelMap& air) {
  Volume shares(scan.grid);
  Mask sure(scan.grid);
  for (size_t v = 0; v < sure.values.size(); ++v) sure.values[v] = air.values[v] != 0;
  if (std::ranges::find(sure.values, uint8_t(1)) == sure.values.end()) return shares;
  const Volume from_air_mm = DistanceMapMm(sure);
  const std::optional<double> brightness = BrightnessUnder(scan, from_air_mm);
  if (!brightness) return shares;
  const double near_mm = kNearVoxels * scan.grid.MeanSpacingMm();
  ParallelEach(shares.values.size(), [&](size_t v) {
    if (sure.values[v])
      shares.values[v] = 1;
    else if (from_air_mm.values[v] <= near_mm)
      shares.values[v] = ShareBelow(0.5 * *brightness, scan, v);
  });
  return shares;
}

}  // namespace kvx
