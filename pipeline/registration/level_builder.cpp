// The finest level from the study, and each coarser one by pooling.
#include "pipeline/registration/level_builder.h"

#include <algorithm>
#include <cmath>

#include "core/distance_transform.h"
#include "core/parallel.h"
#include "kernels/pyramid.h"
#include "pipeline/registration/closed_air.h"
#include "pipeline/registration/contrast_map.h"
#include "pipeline/registration/noise.h"
#include "pipeline/registration/shading.h"
#include "pipeline/registration/start_residual.h"

namespace kvx {
namespace {

constexpr int kMaxLevels = 3;  // blocks of 8, 16 and 32 voxels of the template
constexpr int kCoarsestStep = 1 << (kMaxLevels - 1);

// Residual that a level can take up: coarser levels are left out when a finer one can
constexpr double kReachVoxels = 1.5;
// Of a level's voxels around the body: both sides of the skin's edge count
constexpr double kRingVoxels = 1.5;
constexpr double kBesideClosedVoxels = 2;  // smoothing carries the air's darkness that far into the skin
// Sampling and partial volume: what remains of an edge where registration is right
constexpr double kEdgeErrorVoxels = 0.25;
// From the bone's surface, over which soft tissue gains its freedom: what grows on a bone goes with it
constexpr double kBoneMarginVoxels = 2.5;
constexpr size_t kShadingStride = 5;  // voxels between samples
// Of the template (two blocks), over which displacements fade where the scan shows nothing
constexpr double kFadeVoxels = 16;
constexpr double kActiveVoxels = 8;  // of a level, around the body, where the field is worked on
// Bending of the field in air, relative to tissue: enough to keep it smooth
constexpr double kAirStiffness = 0.05;
// Prior spread of a block's displacement, in block widths, where the start is a voxel off
constexpr double kStrain = 0.019;
constexpr double kLeastStrain = 0.002, kMostStrain = 0.04;

double SmoothStep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Parts of the template on the region's grid; 0 outside the template.
template <class T>
Image<T> Crop(const Image<T>& image, const WorkRegion& region) {
  Image<T> out(region.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = region.grid.Ijk(v) + region.first;
    if (image.grid.Contains(p)) out.values[v] = image(p.x(), p.y(), p.z());
  }
  return out;
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

// What all levels are made of, at the template's own resolution.
struct Finest {
  Mask body, bone;
  Volume body_distance_mm, bone_distance_mm;
  Volume template_volume, scan;  // smoothed
};

Finest PrepareFinest(const RegisterScan::Inputs& inputs, const WorkRegion& region, const Pyramid& pyramid) {
  Finest out;
  out.body = Crop(*inputs.body, region);
  const LabelMap labels = Crop(inputs.bones->labels, region);
  out.bone = Mask(region.grid);
  for (size_t v = 0; v < labels.values.size(); ++v) out.bone.values[v] = labels.values[v] != 0;
  out.body_distance_mm = DistanceMapMm(out.body);
  out.bone_distance_mm = DistanceMapMm(out.bone);
  out.template_volume = Crop(pyramid.Smoothed(inputs.template_scan->volume), region);
  out.scan = pyramid.Smoothed(inputs.scan->volume);
  return out;
}

// Where the start carries every voxel, in scan voxels; those near the body count, but for air that the pose
// closes and the skin beside it, which shows an edge in the template alone.
void FillMap(const RegisterScan::Inputs& inputs, std::span<const Eigen::Vector3f> start_mm,
             const WorkRegion& region, const Finest& finest, BlockLevel& level) {
  const Grid& scan = inputs.scan->volume.grid;
  const double reach_mm = kRingVoxels * kCoarsestStep * region.grid.spacing_mm.maxCoeff();
  ParallelRanges(level.grid.VoxelCount(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v)
      level.start[v] << scan.ToVox(PointMm{start_mm[v].cast<double>()}).ijk.cast<float>(), 0;
  });
  const Volume from_closed_mm = DistanceMapMm(ClosedAir(finest.body, level.start, scan));
  const double beside_mm = kBesideClosedVoxels * region.grid.spacing_mm.maxCoeff();
  for (size_t v = 0; v < level.weight.size(); ++v) {
    const bool in_template =
        inputs.weights->grid.Contains(Eigen::Vector3i(region.grid.Ijk(v) + region.first));
    const bool counts =
        in_template && from_closed_mm.values[v] > beside_mm && finest.body_distance_mm.values[v] <= reach_mm;
    level.weight[v] = counts ? 1 : 0;  // made an inverse variance later
  }
}

BlockLevel Allocate(const Grid& grid) {
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

// From where VBD puts the template's voxels.
std::optional<ContrastMap> ContrastOf(const Finest& finest, const BlockLevel& level) {
  std::vector<float> in_template, in_scan;
  for (size_t v = 0; v < level.weight.size(); ++v) {
    const std::optional<double> s = level.weight[v] > 0 ? Landed(level, finest.scan, v) : std::nullopt;
    if (s) in_template.push_back(finest.template_volume.values[v]), in_scan.push_back(float(*s));
  }
  return FitContrast(in_template, in_scan);
}

Volume Mapped(Volume volume, const std::optional<ContrastMap>& contrast) {
  if (!contrast) return volume;
  for (float& value : volume.values) value = (*contrast)(value);
  return volume;
}

// A magnitude image can be shaded; one with values far below zero is none (CT).
bool IsMagnitude(const Volume& volume) {
  const auto [least, most] = std::minmax_element(volume.values.begin(), volume.values.end());
  return *least > -0.25f * *most;
}

// Shades the template as the scan is, by what both show where the start puts the body.
void Shade(const Finest& finest, const BlockLevel& level, Volume& seen) {
  if (!IsMagnitude(seen) || !IsMagnitude(finest.scan)) return;
  const auto at = [&](size_t v) { return level.grid.ToMm(PointVox{level.grid.Ijk(v).cast<double>()}).lps; };
  std::vector<ShadingSample> samples;
  for (size_t v = 0; v < level.weight.size(); v += kShadingStride) {
    const bool use = finest.body.values[v] && level.weight[v] > 0;
    const std::optional<double> s = use ? Landed(level, finest.scan, v) : std::nullopt;
    if (s) samples.push_back({at(v), seen.values[v], *s});
  }
  const std::optional<Shading> shading = FitShading(samples);
  if (!shading) return;
  ParallelRanges(seen.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) seen.values[v] *= float(shading->At(at(v)));
  });
}

// Brings both images to the same mean and contrast over the body, in units of the noise of their difference.
void Normalise(const RegisterScan::Inputs& inputs, const Finest& finest, BlockLevel& level) {
  const size_t n = level.grid.VoxelCount();
  const std::optional<ContrastMap> contrast = ContrastOf(finest, level);
  Volume seen = Mapped(finest.template_volume, contrast);
  Shade(finest, level, seen);
  const auto in_body = [&](size_t v) { return finest.body.values[v] && level.weight[v] > 0; };
  const Statistics t = StatisticsOf(
      n, [&](size_t v) { return in_body(v) ? std::optional<double>(seen.values[v]) : std::nullopt; });
  const Statistics s =
      StatisticsOf(n, [&](size_t v) { return in_body(v) ? Landed(level, finest.scan, v) : std::nullopt; });
  const double gain = t.spread / s.spread;
  const double noise = std::hypot(NoiseSigma(Mapped(inputs.template_scan->volume, contrast), *inputs.body),
                                  gain * NoiseSigma(inputs.scan->volume));
  for (size_t v = 0; v < n; ++v) level.intensity[v] = float((seen.values[v] - t.mean) / noise);
  level.scan = finest.scan;
  for (float& value : level.scan.values) value = float(gain * (value - s.mean) / noise);
}

// Turns level.weight from the share of usable voxels into inverse variances. A coarse voxel is the mean of
// `pooled` fine ones, so its noise variance is 1 / pooled; the edge error scales with the slope per voxel.
void WeightByVariance(int pooled, BlockLevel& level) {
  ParallelRanges(level.grid.VoxelCount(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (level.weight[v] <= 0) continue;
      const double edge = kEdgeErrorVoxels * kEdgeErrorVoxels * SlopeSquared(level, v);
      level.weight[v] = float(level.weight[v] / (1.0 / pooled + edge));
    }
  });
}

// The least freedom of the voxels that a cell's laplacian looks at.
float LeastMobility(const BlockLevel& level, const Eigen::Vector3i& voxel) {
  float least = 1;
  for (int n = 0; n < 7; ++n) {
    Eigen::Vector3i p = voxel;
    if (n < 6) p[n / 2] += n % 2 ? 2 : -2;
    if (level.grid.Contains(p))
      least = std::min(least, level.mobility[level.grid.Index(p.x(), p.y(), p.z())]);
  }
  return least;
}

// Beside bones the mask bends the field within a voxel or two; that is meant, and not charged as bending.
void FillStiffness(const Volume& body_distance_mm, int step, BlockLevel& level) {
  const double reach_mm = kRingVoxels * level.grid.spacing_mm.maxCoeff();
  const Grid cells = Coarsened(level.grid, 2);
  for (size_t c = 0; c < level.stiffness.size(); ++c) {
    const Eigen::Vector3i p = 2 * step * cells.Ijk(c);
    const float tissue = body_distance_mm(p.x(), p.y(), p.z()) <= reach_mm ? 1.0f : float(kAirStiffness);
    const float free = LeastMobility(level, 2 * cells.Ijk(c));
    level.stiffness[c] = tissue * free * free;
  }
}

bool NearCounting(const BlockLevel& level, const Eigen::Vector3i& cell) {
  for (int n = 0; n < 64; ++n) {
    const Eigen::Vector3i p = 2 * cell + Eigen::Vector3i(n & 3, n >> 2 & 3, n >> 4) - Eigen::Vector3i::Ones();
    if (level.grid.Contains(p) && level.weight[level.grid.Index(p.x(), p.y(), p.z())] > 0) return true;
  }
  return false;
}

void FillActive(const Volume& body_distance_mm, int step, BlockLevel& level) {
  const double reach_mm = kActiveVoxels * level.grid.spacing_mm.maxCoeff();
  const Grid cells = Coarsened(level.grid, 2);
  for (size_t c = 0; c < level.stiffness.size(); ++c) {
    const Eigen::Vector3i p = 2 * step * cells.Ijk(c);
    if (body_distance_mm(p.x(), p.y(), p.z()) > reach_mm) continue;
    level.active.push_back(cl_int(c));
    if (NearCounting(level, cells.Ijk(c))) level.visible.push_back(cl_int(c));
  }
}

// The better the start, the less is left to bend, place by place. The residual is itself a rough estimate, so
// it counts half (in logarithms) beside what is usual: the spread of the prior goes with its square root.
std::vector<float> Firmness(const BlockLevel& measured) {
  constexpr float kLeast = float((kStrain * kStrain) / (kMostStrain * kMostStrain));
  constexpr float kMost = float((kStrain * kStrain) / (kLeastStrain * kLeastStrain));
  std::vector<float> out = LocalResidualVoxels(measured);
  for (float& value : out)
    value = std::clamp(1 / std::max(1e-6f, measured.template_voxels * value), kLeast, kMost);
  return out;
}

void ApplyFirmness(const std::vector<float>& firmness, const BlockLevel& measured, BlockLevel& level) {
  const Grid cells = Coarsened(level.grid, 2), given = Coarsened(measured.grid, 2);
  for (size_t c = 0; c < level.stiffness.size(); ++c) {
    const Eigen::Vector3i p = level.template_voxels * cells.Ijk(c) / measured.template_voxels;
    level.firmness[c] = firmness[given.Index(p.x(), p.y(), p.z())];
    level.stiffness[c] *= level.firmness[c];
  }
}

// Prior: a block's displacement has spread strain * width, so that 1/2 F^T G^-1 F G(c,c) / spread^2 = 1/2
// bending * integral.
double BendingStrength(const Grid& grid) {
  const double spacing = grid.MeanSpacingMm(), spread = kStrain * kBlockVoxels * spacing;
  return 0.5 * kSupportVoxels * spacing * BlockSpline().SelfEnergy() / (16 * kPi * spread * spread);
}

// How deep a voxel lies in the part of the limb that only one of the two scans saw, where VBD puts it; 0 in
// air.
Volume UnseenDepthMm(const WorkRegion& region, const Grid& template_grid, const BlockLevel& level) {
  Mask seen(region.grid, 1);
  for (size_t v = 0; v < seen.values.size(); ++v) {
    const bool in_template = template_grid.Contains(Eigen::Vector3i(region.grid.Ijk(v) + region.first));
    seen.values[v] = in_template && (level.weight[v] <= 0 || Landed(level, level.scan, v).has_value());
  }
  return DistanceMapMm(seen);
}

// None in bone, and fading to none (VBD) where nothing was seen: what a block's spline carries there is
// extrapolation.
void FillMobility(const Finest& finest, const Volume& unseen_mm, BlockLevel& level) {
  const double voxel_mm = level.grid.spacing_mm.maxCoeff();
  for (size_t v = 0; v < level.mobility.size(); ++v) {
    level.mobility[v] = float(FreedomBesideBone(finest.bone_distance_mm.values[v], voxel_mm) *
                              SmoothStep(1 - unseen_mm.values[v] / (kFadeVoxels * voxel_mm)));
  }
}

// Voxels within the ring of this level's width count.
void UseRing(const Volume& body_distance_mm, const BlockLevel& finest, int step, std::vector<float>& use) {
  const double reach_mm = kRingVoxels * step * finest.grid.spacing_mm.maxCoeff();
  for (size_t v = 0; v < use.size(); ++v)
    use[v] = finest.weight[v] > 0 && body_distance_mm.values[v] <= reach_mm ? 1 : 0;
}

// Means over the 2 x 2 x 2 voxels that count; mobility takes the least of them.
BlockLevel Halved(const BlockLevel& fine) {
  BlockLevel out = Allocate(Coarsened(fine.grid, 2));
  out.template_voxels = 2 * fine.template_voxels;
  ParallelRanges(out.grid.VoxelCount(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3i p = 2 * out.grid.Ijk(v);
      float known = 0, intensity = 0, mobility = 1;
      for (int c = 0; c < 8; ++c) {
        const size_t u = fine.grid.Index(p.x() + (c & 1), p.y() + ((c >> 1) & 1), p.z() + (c >> 2));
        intensity += fine.intensity[u];
        mobility = std::min(mobility, fine.mobility[u]);
        out.start[v] += fine.start[u] / 8;
        known += fine.weight[u] > 0 ? 1.0f : 0.0f;
      }
      // Scan voxels of the coarser scan: (p - 0.5) / 2.
      out.start[v].head<3>() = 0.5f * (out.start[v].head<3>().array() - 0.5f);
      out.intensity[v] = intensity / 8;
      out.mobility[v] = mobility;
      out.weight[v] = known / 8;
    }
  });
  return out;
}

bool CanHalve(const BlockLevel& level) {
  return level.grid.size.minCoeff() >= kSupportVoxels && level.scan.grid.size.minCoeff() >= 8;
}

}  // namespace

double FreedomBesideBone(double bone_distance_mm, double voxel_mm) {
  return SmoothStep(bone_distance_mm / (kBoneMarginVoxels * voxel_mm));
}

WorkRegion RegionAround(const Mask& body) {
  Eigen::Vector3i lo = body.grid.size, hi = Eigen::Vector3i::Constant(-1);
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (!body.values[v]) continue;
    const Eigen::Vector3i p = body.grid.Ijk(v);
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  if (hi.x() < 0) throw InputError("the template shows no body to register; check its intensities");
  WorkRegion region;
  region.first = lo - Eigen::Vector3i::Constant(kBlockVoxels);
  region.grid = body.grid;
  region.grid.size = ((hi - region.first).array() + 1 + kBlockVoxels + 7) / 8 * 8;
  region.grid.origin = body.grid.ToMm(PointVox{region.first.cast<double>()});
  return region;
}

std::vector<BlockLevel> BuildLevels(const RegisterScan::Inputs& inputs,
                                    std::span<const Eigen::Vector3f> start_mm, const WorkRegion& region,
                                    Backend& backend) {
  const Pyramid pyramid(backend);
  const Finest finest = PrepareFinest(inputs, region, pyramid);
  std::vector<BlockLevel> levels;
  levels.push_back(Allocate(region.grid));
  FillMap(inputs, start_mm, region, finest, levels[0]);
  Normalise(inputs, finest, levels[0]);
  FillMobility(finest, UnseenDepthMm(region, inputs.weights->grid, levels[0]), levels[0]);
  while (int(levels.size()) < kMaxLevels && CanHalve(levels.back())) {
    BlockLevel coarse = Halved(levels.back());
    coarse.scan = pyramid.Halved(levels.back().scan);
    levels.push_back(std::move(coarse));
  }
  // Which voxels count differs per level: the ring around the body is as wide as the level's voxels.
  std::vector<float> use(levels[0].weight.size());
  for (size_t l = levels.size(); l-- > 0;) {
    const int step = 1 << l;
    UseRing(finest.body_distance_mm, levels[0], step, use);
    BlockLevel& level = levels[l];
    for (size_t v = 0; v < level.weight.size(); ++v) {
      const Eigen::Vector3i p = step * level.grid.Ijk(v);
      float sum = 0;
      for (int c = 0; c < step * step * step; ++c) {
        sum += use[region.grid.Index(p.x() + c % step, p.y() + c / step % step, p.z() + c / (step * step))];
      }
      if (level.weight[v] > 0) level.weight[v] = sum / float(step * step * step);
    }
    WeightByVariance(step * step * step, level);
    FillStiffness(finest.body_distance_mm, step, level);
    FillActive(finest.body_distance_mm, step, level);
    level.bending = BendingStrength(level.grid);
  }
  size_t start = 0;  // the finest level within whose reach the residual is
  while (start + 1 < levels.size() && ResidualVoxels(levels[start]) > kReachVoxels) ++start;
  levels.resize(start + 1);
  const std::vector<float> firmness = Firmness(levels.back());
  for (BlockLevel& level : levels) ApplyFirmness(firmness, levels.back(), level);
  return levels;
}

}  // namespace kvx
