// What template and scan show is brought to the same contrast, shading, mean and noise.
#include "pipeline/registration/level_images.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/distance_transform.h"
#include "core/parallel.h"
#include "pipeline/registration/closed_air.h"
#include "pipeline/registration/contrast_map.h"
#include "pipeline/registration/grey_table.h"
#include "pipeline/registration/noise.h"
#include "pipeline/registration/shading.h"
#include "pipeline/registration/start_residual.h"
#include "pipeline/skinning/air_level.h"

namespace kvx {
namespace {

constexpr double kBesideClosedVoxels = 2;  // smoothing carries the air's darkness that far into the skin
// Beyond a bone's coat, over which soft tissue gains its freedom
constexpr double kBoneMarginVoxels = 1.75;
constexpr size_t kShadingStride = 5;  // voxels between samples
// What a map between contrasts gets wrong is wrong over whole tissues: so many voxels say no more than one.
constexpr double kMapErrorVoxels = 3;
// Of the template (two blocks), over which displacements fade where the scan shows nothing
constexpr double kFadeVoxels = 16;

double SmoothStep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

struct Statistics {
  double mean = 0, spread = 1;
};

template <class Value>
Statistics StatisticsOf(size_t count, Value value) {  // value(v) -> optional<double>
  double n = 0, sum = 0, squares = 0;
  for (size_t v = 0; v < count; ++v) {
    if (const std::optional<double> x = value(v)) n += 1, sum += *x, squares += *x * *x;
  }
  if (n < 1) return {};
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(1e-12, squares / n - mean * mean))};
}

// Where the start carries every voxel, in scan voxels; those near the body count, but for air that the pose
// closes and the skin beside it, which shows an edge in the template alone.
void FillMap(const RegisterScan::Inputs& inputs, std::span<const Eigen::Vector3f> start_mm,
             const WorkRegion& region, const LevelImages& images, BlockLevel& level) {
  const Grid& scan = inputs.scan->volume.grid;
  const double reach_mm = kWidestRingVoxels * region.grid.spacing_mm.maxCoeff();
  ParallelRanges(level.grid.VoxelCount(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v)
      level.start[v] << scan.ToVox(PointMm{start_mm[v].cast<double>()}).ijk.cast<float>(), 0;
  });
  const Volume from_closed_mm = DistanceMapMm(ClosedAir(images.body, level.start, scan));
  const double beside_mm = kBesideClosedVoxels * region.grid.spacing_mm.maxCoeff();
  ParallelRanges(level.weight.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const bool in_template =
          inputs.weights->grid.Contains(Eigen::Vector3i(region.grid.Ijk(v) + region.first));
      const bool counts = in_template && from_closed_mm.values[v] > beside_mm &&
                          images.body_distance_mm.values[v] <= reach_mm;
      level.weight[v] = counts ? 1 : 0;  // made an inverse variance later
    }
  });
}

// What the scan shows where the start puts the voxels that count; nothing elsewhere.
class Landings {
 public:
  Landings(const LevelImages& images, const BlockLevel& level)
      : shown_(level.weight.size(), std::numeric_limits<float>::quiet_NaN()) {
    ParallelRanges(shown_.size(), [&](size_t begin, size_t end) {
      for (size_t v = begin; v < end; ++v) {
        const auto s = level.weight[v] > 0 ? Landed(level, images.scan, v) : std::nullopt;
        if (s) shown_[v] = float(*s);
      }
    });
  }
  std::optional<double> operator()(size_t v) const {
    return std::isnan(shown_[v]) ? std::nullopt : std::optional<double>(shown_[v]);
  }
  std::span<const float> shown() const { return shown_; }  // not a number: nothing

 private:
  std::vector<float> shown_;
};

// From where VBD puts the template's voxels.
std::optional<ContrastMap> ContrastOf(const LevelImages& images, const Landings& landings) {
  std::vector<float> in_template, in_scan;
  for (size_t v = 0; v < images.template_volume.values.size(); ++v) {
    const std::optional<double> s = landings(v);
    if (s) in_template.push_back(images.template_volume.values[v]), in_scan.push_back(float(*s));
  }
  return FitContrast(in_template, in_scan);
}

// The template in the greys of the scan.
void ShowAsScan(const Landings& landings, Volume& seen) {
  const std::vector<Eigen::Vector3f> greys = SurroundedGreys(seen);
  const GreyTable table(greys, landings.shown());
  ParallelRanges(greys.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) seen.values[v] = table(greys[v]);
  });
}

// Shades the template as the scan is, by what both show where the start puts the body.
void Shade(const LevelImages& images, const BlockLevel& level, const Landings& landings, Volume& seen) {
  if (!IsMagnitude(seen) || !IsMagnitude(images.scan)) return;
  const auto at = [&](size_t v) { return level.grid.ToMm(PointVox{level.grid.Ijk(v).cast<double>()}).lps; };
  std::vector<ShadingSample> samples;
  for (size_t v = 0; v < level.weight.size(); v += kShadingStride) {
    const std::optional<double> s = images.body.values[v] ? landings(v) : std::nullopt;
    if (s) samples.push_back({at(v), seen.values[v], *s});
  }
  const std::optional<Shading> shading = FitShading(samples);
  if (!shading) return;
  ParallelRanges(seen.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) seen.values[v] *= float(shading->At(at(v)));
  });
}

// Mean square of what a map between contrasts does not explain, noise included.
double UnexplainedSquared(const LevelImages& images, const Landings& landings, const Volume& seen,
                          const Statistics& in_template, const Statistics& in_scan) {
  const double gain = in_template.spread / in_scan.spread;
  double sum = 0, count = 0;
  for (size_t v = 0; v < seen.values.size(); ++v) {
    const std::optional<double> s = images.body.values[v] ? landings(v) : std::nullopt;
    if (!s) continue;
    const double apart = seen.values[v] - in_template.mean - gain * (*s - in_scan.mean);
    sum += apart * apart, count += 1;
  }
  return count > 0 ? sum / count : 0;
}

// With what the map gets wrong, which every voxel shares with its neighbours.
double NoiseOfMap(double noise, double unexplained_squared) {
  return std::sqrt(noise * noise + kMapErrorVoxels * std::max(0.0, unexplained_squared - noise * noise));
}

// Brings both images to the same mean and contrast over the body, in units of the noise of their difference.
void Normalise(const RegisterScan::Inputs& inputs, const LevelImages& images, BlockLevel& level) {
  const size_t n = level.grid.VoxelCount();
  const Landings landings(images, level);
  const std::optional<ContrastMap> contrast = ContrastOf(images, landings);
  Volume seen = images.template_volume;
  if (contrast) ShowAsScan(landings, seen);
  Shade(images, level, landings, seen);
  const auto in_body = [&](size_t v) { return images.body.values[v] && level.weight[v] > 0; };
  const Statistics t = StatisticsOf(
      n, [&](size_t v) { return in_body(v) ? std::optional<double>(seen.values[v]) : std::nullopt; });
  const Statistics s =
      StatisticsOf(n, [&](size_t v) { return images.body.values[v] ? landings(v) : std::nullopt; });
  const double gain = t.spread / s.spread;
  double noise = std::hypot(NoiseSigma(Mapped(inputs.template_scan->volume, contrast), *inputs.body),
                            gain * NoiseSigma(inputs.scan->volume));
  if (contrast) noise = NoiseOfMap(noise, UnexplainedSquared(images, landings, seen, t, s));
  for (size_t v = 0; v < n; ++v) level.intensity[v] = float((seen.values[v] - t.mean) / noise);
  level.scan = images.scan;
  for (float& value : level.scan.values) value = float(gain * (value - s.mean) / noise);
}

// How deep a voxel lies in the part of the limb that only one of the two scans saw, where VBD puts it; 0 in
// air.
Volume UnseenDepthMm(const WorkRegion& region, const Grid& template_grid, const BlockLevel& level) {
  Mask seen(region.grid, 1);
  ParallelRanges(seen.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const bool in_template = template_grid.Contains(Eigen::Vector3i(region.grid.Ijk(v) + region.first));
      seen.values[v] = in_template && (level.weight[v] <= 0 || Landed(level, level.scan, v).has_value());
    }
  });
  return DistanceMapMm(seen);
}

// None in bone, and fading to none (VBD) where nothing was seen: what a block's spline carries there is
// extrapolation.
void FillMobility(const LevelImages& images, const Volume& unseen_mm, BlockLevel& level) {
  const double voxel_mm = level.grid.spacing_mm.maxCoeff();
  for (size_t v = 0; v < level.mobility.size(); ++v) {
    level.mobility[v] = float(FreedomBesideBone(images.beyond_coat_mm.values[v], voxel_mm) *
                              SmoothStep(1 - unseen_mm.values[v] / (kFadeVoxels * voxel_mm)));
  }
}

}  // namespace

double FreedomBesideBone(double beyond_coat_mm, double voxel_mm) {
  return SmoothStep(beyond_coat_mm / (kBoneMarginVoxels * voxel_mm));
}

LevelImages PrepareImages(const RegisterScan::Inputs& inputs, const Volume& beyond_coat_mm,
                          const WorkRegion& region, const Pyramid& pyramid) {
  LevelImages out{.beyond_coat_mm = beyond_coat_mm};
  out.body = Crop(*inputs.body, region);
  out.body_distance_mm = DistanceMapMm(out.body);
  out.template_volume = Crop(pyramid.Smoothed(inputs.template_scan->volume), region);
  out.scan = pyramid.Smoothed(inputs.scan->volume);
  return out;
}

BlockLevel EmptyLevel(const Grid& grid) {
  BlockLevel level;
  level.grid = grid;
  const size_t n = grid.VoxelCount();
  level.start.assign(n, FieldVector::Zero());
  level.intensity.resize(n);
  level.weight.resize(n);
  level.mobility.resize(n);
  level.stiffness.resize(n / 8);
  level.firmness.resize(n / 8);
  return level;
}

BlockLevel FinestLevel(const RegisterScan::Inputs& inputs, const LevelImages& images,
                       std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region) {
  BlockLevel level = EmptyLevel(region.grid);
  FillMap(inputs, start_mm, region, images, level);
  Normalise(inputs, images, level);
  FillMobility(images, UnseenDepthMm(region, inputs.weights->grid, level), level);
  return level;
}

}  // namespace kvx
