// Factors are spreads of logarithms. What the start misplaces spreads both alike, so that it moves no origin
// as it would move a line's. Shading and origin are found in turns.
#include "pipeline/registration/images/scan_origin.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/numbers/smooth_step.h"

namespace kvx {
namespace {

constexpr size_t kEnough = 6000;
constexpr int kTurns = 8;
constexpr double kAtRest = 0.005;             // of the scan's mean
constexpr double kLeast = -1.5, kMost = 0.6;  // origins, of the scan's mean
constexpr int kHalvings = 20;
// Of the scan's mean: noise and misplaced tissue make as much of none; from here on an origin counts in full.
constexpr double kOfNoise = 0.05, kOrigin = 0.15;
constexpr double kDark = 0.4;  // of the mean, in both alike: air and cortical bone have no factor
constexpr double kReach = 9;   // weights end at that many robust deviations
constexpr double kLeastSpread = 0.02;

struct Lit {
  double in_template = 0, in_scan = 0;  // of the scan with its origin
  double shade = 1, weight = 0;
};

struct Moments {
  double count = 0, sum = 0, squares = 0;
  void Add(double weight, double x) { count += weight, sum += weight * x, squares += weight * x * x; }
  double Spread() const {
    return count > 0 ? std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count))) : 0;
  }
};

// Beyond that of the template.
double SpreadBeyond(const std::vector<Lit>& samples, double origin, double dark) {
  Moments of_template, of_scan;
  for (const Lit& sample : samples) {
    const double scan = (sample.in_scan - origin) / sample.shade;
    if (sample.weight == 0 || sample.in_template < dark || scan < dark) continue;
    of_template.Add(sample.weight, std::log(sample.in_template));
    of_scan.Add(sample.weight, std::log(scan));
  }
  return of_scan.Spread() - of_template.Spread();
}

// Less where the start misplaces tissue.
void Weigh(double origin, std::vector<Lit>& samples) {
  std::vector<double> off(samples.size(), std::numeric_limits<double>::infinity());
  ParallelEach(off.size(), [&](size_t n) {
    const double scan = (samples[n].in_scan - origin) / samples[n].shade;
    if (scan > 0 && samples[n].in_template > 0) off[n] = std::abs(std::log(scan / samples[n].in_template));
  });
  std::vector<double> sorted = off;
  const double reach = kReach * std::max(kLeastSpread, kSdOfMad * TakeMedian(sorted));
  for (size_t n = 0; n < samples.size(); ++n) {
    const double part = off[n] / reach;
    samples[n].weight = part < 1 ? (1 - part * part) * (1 - part * part) : 0;
  }
}

std::vector<ShadingSample> Thinned(std::span<const ShadingSample> samples) {
  const size_t stride = std::max<size_t>(1, samples.size() / kEnough);
  std::vector<ShadingSample> out;
  for (size_t n = 0; n < samples.size(); n += stride) out.push_back(samples[n]);
  return out;
}

double MeanOf(std::span<const ShadingSample> samples, double ShadingSample::*grey) {
  double sum = 0;
  for (const ShadingSample& sample : samples) sum += sample.*grey;
  return sum / double(samples.size());
}

// The greater the origin, the greater are factors.
double OriginFor(const std::vector<Lit>& samples, double mean, double dark) {
  double least = kLeast * mean, most = kMost * mean;
  for (int n = 0; n < kHalvings; ++n) {
    const double middle = (least + most) / 2;
    (SpreadBeyond(samples, middle, dark) > 0 ? most : least) = middle;
  }
  return (least + most) / 2;
}

}  // namespace

double FitScanOrigin(std::span<const ShadingSample> all) {
  if (all.empty()) return 0;
  const std::vector<ShadingSample> samples = Thinned(all);
  const double mean = MeanOf(samples, &ShadingSample::scan_value);
  const double dark = kDark * MeanOf(samples, &ShadingSample::template_value);
  if (!(mean > 0 && dark > 0)) return 0;
  double origin = 0;
  for (int turn = 0; turn < kTurns; ++turn) {
    std::vector<ShadingSample> from_origin = samples;
    for (ShadingSample& sample : from_origin) sample.scan_value -= origin;
    const std::optional<Shading> shading = FitShading(from_origin);
    if (!shading) return 0;
    std::vector<Lit> lit(samples.size());
    ParallelEach(lit.size(), [&](size_t n) {
      lit[n] = {samples[n].template_value, samples[n].scan_value, shading->At(samples[n].x_mm), 0};
    });
    Weigh(origin, lit);
    const double before = std::exchange(origin, OriginFor(lit, mean, dark));
    if (std::abs(origin - before) < kAtRest * mean) break;
  }
  return SmoothStep(kOfNoise, kOrigin, std::abs(origin) / mean) * origin;
}

}  // namespace kvx
