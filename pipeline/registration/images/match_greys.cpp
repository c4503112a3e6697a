// First the contrast, then the shading of the scan, then what is left of the template's, and units of noise.
#include "pipeline/registration/images/match_greys.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "core/host/parallel.h"
#include "core/voxels/finer_grid.h"
#include "pipeline/registration/images/grey_origin.h"
#include "pipeline/registration/images/grey_table.h"
#include "pipeline/registration/images/noise.h"
#include "pipeline/registration/images/scan_origin.h"
#include "pipeline/registration/images/shading.h"
#include "pipeline/registration/images/start_residual.h"
#include "pipeline/registration/images/usual_residual.h"
#include "pipeline/scans/contrast_map.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

// Of a region's voxels, how many say as much as all: of a curve, and of a shading's ten coefficients.
constexpr size_t kEnoughForContrast = 1000000, kEnoughForShading = 200000;
constexpr size_t kLeastShadingStride = 5;
// What a map between contrasts gets wrong is wrong over whole tissues: two voxels say no more than one.
constexpr double kMapErrorVoxels = 2;

// Voxels from one sample to the next, of `enough` samples or more; rows are not sampled at the same places.
size_t StrideOf(const Grid& grid, size_t enough, size_t least = 1) {
  size_t stride = std::max(least, grid.VoxelCount() / enough);
  while (std::gcd(stride, size_t(grid.size.x())) > 1 && stride > least) --stride;
  return stride;
}

constexpr double kRounding = 1e-12;  // of a mean square, in sums

struct Statistics {
  double mean = 0, spread = 1;
};

struct Sums {
  double count = 0, values = 0, squares = 0;
  Sums& operator+=(const Sums& other) {
    count += other.count, values += other.values, squares += other.squares;
    return *this;
  }
};

template <class Value>
Statistics StatisticsOf(size_t count, Value value) {  // value(v) -> optional<double>
  const auto sum = ParallelSum<Sums>(count, [&](Sums& so_far, size_t v) {
    if (const std::optional<double> x = value(v)) so_far += {1, *x, *x * *x};
  });
  if (sum.count < 1) return {};
  const double mean = sum.values / sum.count, square = sum.squares / sum.count;
  return {mean, square > 0 ? std::sqrt(std::max(kRounding * square, square - mean * mean)) : 1};
}

// What the scan shows where the start puts the voxels that count; nothing elsewhere.
class Landings {
 public:
  Landings(const Volume& scan, const BlockLevel& level)
      : shown_(level.weight.size(), std::numeric_limits<float>::quiet_NaN()) {
    ParallelEach(shown_.size(), [&](size_t v) {
      const auto s = level.weight[v] > 0 ? Landed(level, scan, v) : std::nullopt;
      if (s) shown_[v] = float(*s);
    });
  }
  std::optional<double> operator()(size_t v) const {
    return std::isnan(shown_[v]) ? std::nullopt : std::optional<double>(shown_[v]);
  }
  std::span<const float> shown() const { return shown_; }  // not a number: nothing

 private:
  std::vector<float> shown_;
};

// From where VBD puts the template's voxels: in bones and beside them, where the bones themselves were found.
std::optional<ContrastMap> ContrastOf(const Volume& template_volume, const LevelImages& images,
                                      const Landings& landings) {
  GreyPairs all, by_bones;
  const double beside_mm = template_volume.grid.MeanSpacingMm();
  const size_t stride = StrideOf(template_volume.grid, kEnoughForContrast);
  for (size_t v = 0; v < template_volume.values.size(); v += stride) {
    const std::optional<double> s = landings(v);
    if (!s) continue;
    all.Add(template_volume.values[v], float(*s));
    if (images.beyond_coat_mm.values[v] <= beside_mm) by_bones.Add(template_volume.values[v], float(*s));
  }
  return FitContrast(all, by_bones);
}

// The template in the greys of the scan.
Volume ShownAsScan(Volume volume, const Landings& landings) {
  const std::vector<Eigen::Vector3f> greys = SurroundedGreys(volume);
  const GreyTable table(greys, landings.shown());
  ParallelEach(greys.size(), [&](size_t v) { volume.values[v] = table(greys[v]); });
  return volume;
}

// Of what both show where the start puts the body: of the scan, whose greys are magnitudes, beside the
// template `seen`. `place(v)`: where a voxel lies on `grid`. None where the template's greys are no
// magnitudes.
template <class Place>
std::vector<ShadingSample> SamplesOf(const Grid& grid, const LevelImages& images, const Volume& seen,
                                     const Landings& landings, Place place) {
  std::vector<ShadingSample> samples;
  if (!IsMagnitude(seen)) return samples;
  const size_t stride = StrideOf(seen.grid, kEnoughForShading, kLeastShadingStride);
  for (size_t v = 0; v < seen.values.size(); v += stride) {
    const std::optional<double> s = images.body.values[v] ? landings(v) : std::nullopt;
    if (s) samples.push_back({grid.ToMm(place(v)).lps, seen.values[v], *s});
  }
  return samples;
}

void Divide(Volume& volume, const Volume& by) {
  ParallelEach(volume.values.size(), [&](size_t v) { volume.values[v] /= by.values[v]; });
}
void Multiply(Volume& volume, const Volume& by) {
  ParallelEach(volume.values.size(), [&](size_t v) { volume.values[v] *= by.values[v]; });
}

// Both images in one contrast and one light.
struct Pair {
  Volume seen;       // the template
  Volume scan, raw;  // smoothed; as it came, on a grid of its own
  Landings landings;
  std::optional<ContrastMap> contrast;
};

// Coils shade what lies still, so the scan's shading is looked for on its own grid and taken out of it: then
// its tissue weighs the same in light and in shadow. What moves with the limb is the template's, and is left.
// `shown`: its scan is taken, and its template where that is in the same contrast.
Pair InOneLight(const LevelImages& images, ShownPair& shown, const BlockLevel& level) {
  Landings landings(shown.scan, level);
  Pair out{{}, std::move(shown.scan), images.measured_scan, std::move(landings), {}};
  out.contrast = ContrastOf(shown.template_volume, images, out.landings);
  const auto show = [&] {
    if (out.contrast) out.seen = ShownAsScan(shown.template_volume, out.landings);
  };
  if (!out.contrast) out.seen = std::move(shown.template_volume);
  show();
  if (!IsMagnitude(images.scan)) return out;
  const auto in_scan = [&](size_t v) { return PointVox{level.start[v].head<3>().cast<double>()}; };
  std::vector<ShadingSample> samples = SamplesOf(images.scan.grid, images, out.seen, out.landings, in_scan);
  const float origin = out.contrast ? 0 : float(FitScanOrigin(samples));
  for (ShadingSample& sample : samples) sample.scan_value -= origin;
  if (const auto coil = FitShading(samples)) {
    const Volume on_raw = coil->On(out.raw.grid);
    out.raw = FromOrigin(std::move(out.raw), origin), out.scan = FromOrigin(std::move(out.scan), origin);
    Divide(out.raw, on_raw);
    Divide(out.scan, out.scan.grid == out.raw.grid ? on_raw : coil->On(out.scan.grid));
    out.landings = Landings(out.scan, level);
    show();
  }
  const auto in_template = [&](size_t v) { return PointVox{level.grid.Ijk(v).cast<double>()}; };
  if (const auto left = FitShading(SamplesOf(level.grid, images, out.seen, out.landings, in_template)))
    Multiply(out.seen, left->On(level.grid));
  return out;
}

// Mean square of what a map between contrasts does not explain, noise included.
double UnexplainedSquared(const LevelImages& images, const Pair& pair, const Statistics& in_template,
                          const Statistics& in_scan) {
  const double gain = in_template.spread / in_scan.spread;
  double sum = 0, count = 0;
  for (size_t v = 0; v < pair.seen.values.size(); ++v) {
    const std::optional<double> s = images.body.values[v] ? pair.landings(v) : std::nullopt;
    if (!s) continue;
    const double apart = pair.seen.values[v] - in_template.mean - gain * (*s - in_scan.mean);
    sum += apart * apart, count += 1;
  }
  return count > 0 ? sum / count : 0;
}

// With what the map gets wrong beyond what well registered tissue shows; neighbouring voxels share it.
double NoiseOfMap(double noise, double unexplained_squared) {
  const double usual = kUsualResidual * noise * noise;
  return std::sqrt(noise * noise + kMapErrorVoxels * std::max(0.0, unexplained_squared - usual));
}

}  // namespace

void MatchGreys(const RegistrationInputs& inputs, const LevelImages& images, ShownPair shown,
                BlockLevel& level) {
  const double template_noise = shown.template_noise, scan_noise = shown.scan_noise;
  Pair pair = InOneLight(images, shown, level);
  const size_t n = level.grid.VoxelCount();
  // Both of the same tissue: what lies beyond the scan may be fatter.
  const auto shown_at = [&](size_t v) { return images.body.values[v] ? pair.landings(v) : std::nullopt; };
  const Statistics t = StatisticsOf(
      n, [&](size_t v) { return shown_at(v) ? std::optional<double>(pair.seen.values[v]) : std::nullopt; });
  const Statistics s = StatisticsOf(n, shown_at);
  const double gain = t.spread / s.spread;
  const Volume& given = inputs.template_scan->volume;
  const OwnOrLent<Volume> whole =
      pair.contrast ? OwnOrLent(Mapped(FromOrigin(given, images.template_origin), pair.contrast)) : given;
  double noise = std::hypot(template_noise * NoiseSigma(*EveryVoxelOf(*whole, images.times),
                                                        *EveryVoxelOf(*inputs.body, images.times)),
                            scan_noise * gain * NoiseSigma(pair.raw));
  if (pair.contrast) noise = NoiseOfMap(noise, UnexplainedSquared(images, pair, t, s));
  if (pair.contrast) level.own_greys = std::move(shown.template_volume.values);
  ParallelEach(n, [&](size_t v) { level.intensity[v] = float((pair.seen.values[v] - t.mean) / noise); });
  level.scan = std::move(pair.scan);
  ParallelEach(level.scan.values.size(), [&](size_t v) {
    level.scan.values[v] = float(gain * (level.scan.values[v] - s.mean) / noise);
  });
}

}  // namespace kvx
