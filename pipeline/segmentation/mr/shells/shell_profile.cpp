// Two unknown levels by least squares for each place of the shell. Where a shell is not resolved its darkness
// times its thickness is all that shows, so its intensity is taken as known.
#include "pipeline/segmentation/mr/shells/shell_profile.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr double kShell = 0.1;      // intensity of cortex
constexpr double kMarrowTie = 0.1;  // squares that marrow pays for differing from its level
constexpr double kLeastMarrow = 0.6, kMostMarrow = 1.2, kMostOther = 1.4;

double Step(double place, double blur) { return 0.5 * (1 + std::erf(place / (blur * std::sqrt(2.0)))); }

// A blurred disc at a distance from its centre, by strips across the line to there.
double Disc(double radius, double from_centre, double blur) {
  constexpr int kStrips = 40;
  const double low = std::max(-radius, from_centre - 4 * blur);
  const double high = std::min(radius, from_centre + 4 * blur);
  if (low >= high) return 0;
  double sum = 0;
  for (int n = 0; n < kStrips; ++n) {
    const double x = std::lerp(low, high, (n + 0.5) / kStrips), z = (x - from_centre) / blur;
    sum += std::exp(-0.5 * z * z) * std::erf(std::sqrt((radius * radius - x * x) / 2) / blur);
  }
  return sum * (high - low) / (kStrips * blur * std::sqrt(2 * M_PI));
}

// How much of what is seen at `place` lies within a surface at `surface`.
double Within(double surface, double place, double blur, double radius) {
  return std::isfinite(radius) ? Disc(radius + surface, radius + place, blur) : Step(surface - place, blur);
}

}  // namespace

ShellProfile::ShellProfile(double blur, double thickness, double radius) {
  for (int offset = 0; offset < kOffsets; ++offset) {
    Shares s{};
    for (int n = 0; n < kSamples; ++n) {
      const double outer = OffsetOf(offset);
      const double other = 1 - Within(outer, PlaceOf(n), blur, radius);
      const double marrow = Within(outer - thickness, PlaceOf(n), blur, radius);
      s.marrow[n] = float(marrow), s.other[n] = float(other),
      s.shell[n] = float(kShell * (1 - marrow - other));
    }
    s.Sum();
    shares_.push_back(s);
  }
}

void ShellProfile::Shares::Sum() {
  marrow2 = kMarrowTie, marrow_other = 0, other2 = 1e-3;
  for (int n = 0; n < kSamples; ++n)
    marrow2 += marrow[n] * marrow[n], marrow_other += marrow[n] * other[n], other2 += other[n] * other[n];
}

ShellProfile::Shares ShellProfile::SharesOfSeen(const Shares& shares, const Samples& samples) {
  Shares seen = shares;
  for (int n = 0; n < kSamples; ++n) {
    if (std::isnan(samples[n])) seen.marrow[n] = seen.shell[n] = seen.other[n] = 0;
  }
  seen.Sum();
  return seen;
}

float ShellProfile::MisfitOf(const Shares& s, const Samples& samples) const {
  double marrow_sum = kMarrowTie, other_sum = 0;
  for (int n = 0; n < kSamples; ++n) {
    const double left = samples[n] - s.shell[n];
    marrow_sum += left * s.marrow[n], other_sum += left * s.other[n];
  }
  const double determinant = s.marrow2 * s.other2 - s.marrow_other * s.marrow_other;
  const double marrow = std::clamp((s.other2 * marrow_sum - s.marrow_other * other_sum) / determinant,
                                   kLeastMarrow, kMostMarrow);
  const double other = std::clamp((other_sum - s.marrow_other * marrow) / s.other2, 0.0, kMostOther);
  double misfit = kMarrowTie * (marrow - 1) * (marrow - 1);
  for (int n = 0; n < kSamples; ++n) {
    const double left = samples[n] - s.shell[n] - marrow * s.marrow[n] - other * s.other[n];
    misfit += left * left;
  }
  return float(misfit / kSamples);
}

ShellProfile::Misfits ShellProfile::MisfitsOf(const Samples& samples) const {
  Misfits misfits;
  const bool all = std::ranges::none_of(samples, [](float s) { return std::isnan(s); });
  Samples seen = samples;
  std::ranges::replace_if(
      seen, [](float s) { return std::isnan(s); }, 0.0f);
  for (int offset = 0; offset < kOffsets; ++offset)
    misfits[offset] = MisfitOf(all ? shares_[offset] : SharesOfSeen(shares_[offset], samples), seen);
  return misfits;
}

}  // namespace kvx
