// Means of the scan's intensities over bins of the template's, compared with a straight line.
#include "pipeline/registration/contrast_map.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kvx {
namespace {

constexpr int kKnots = 24;
constexpr double kTail = 0.01;           // of the template's values beyond the first and the last knot
constexpr double kLeastShare = 0.002;    // of all values, for a knot to speak for itself
constexpr double kLeastExplained = 0.1;  // more of the scan's variance than the line explains

struct Sums {
  double n = 0, s = 0;
  double Mean() const { return n > 0 ? s / n : 0; }
};

float Quantile(std::vector<float> values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Knots without enough values take the nearest ones' line.
void FillGaps(const std::vector<Sums>& knots, double total, std::vector<float>& at_knot) {
  std::vector<int> known;
  for (int k = 0; k < kKnots; ++k) {
    if (knots[size_t(k)].n >= kLeastShare * total) known.push_back(k);
  }
  for (int k = 0; k < kKnots && !known.empty(); ++k) {
    const auto above = std::ranges::lower_bound(known, k);
    const int hi = above == known.end() ? known.back() : *above;
    const int lo = above == known.begin() || (above != known.end() && *above == k) ? hi : *(above - 1);
    const double t = hi > lo ? double(k - lo) / (hi - lo) : 0;
    at_knot[size_t(k)] = float((1 - t) * knots[size_t(lo)].Mean() + t * knots[size_t(hi)].Mean());
  }
}

struct Explained {
  double by_line = 0, by_curve = 0;  // shares of the scan's variance
};

Explained Compare(const ContrastMap& map, std::span<const float> t, std::span<const float> s) {
  const double n = double(t.size());
  const double mean_t = std::accumulate(t.begin(), t.end(), 0.0) / n,
               mean_s = std::accumulate(s.begin(), s.end(), 0.0) / n;
  double tt = 0, ts = 0, ss = 0, left = 0;
  for (size_t i = 0; i < t.size(); ++i) {
    const double a = t[i] - mean_t, b = s[i] - mean_s, c = s[i] - map(t[i]);
    tt += a * a, ts += a * b, ss += b * b, left += c * c;
  }
  if (!(tt > 0 && ss > 0)) return {1, 1};
  return {ts > 0 ? ts * ts / (tt * ss) : 0.0, 1 - left / ss};
}

}  // namespace

float ContrastMap::operator()(float value) const {
  const float at = std::clamp((value - low) / step, 0.0f, float(at_knot.size() - 1));
  const size_t k = std::min(size_t(at), at_knot.size() - 2);
  return at_knot[k] + (at - float(k)) * (at_knot[k + 1] - at_knot[k]);
}

std::optional<ContrastMap> FitContrast(std::span<const float> template_values,
                                       std::span<const float> scan_values) {
  if (template_values.size() < size_t(kKnots)) return std::nullopt;
  const std::vector<float> all(template_values.begin(), template_values.end());
  ContrastMap map;
  map.low = Quantile(all, kTail);
  map.step = (Quantile(all, 1 - kTail) - map.low) / (kKnots - 1);
  if (!(map.step > 0)) return std::nullopt;
  map.at_knot.assign(kKnots, 0.0f);
  std::vector<Sums> knots(kKnots);
  for (size_t i = 0; i < template_values.size(); ++i) {
    const float at = std::clamp((template_values[i] - map.low) / map.step, 0.0f, float(kKnots - 1));
    Sums& knot = knots[size_t(std::lround(at))];
    knot.n += 1, knot.s += scan_values[i];
  }
  FillGaps(knots, double(template_values.size()), map.at_knot);
  const Explained explained = Compare(map, template_values, scan_values);
  if (explained.by_curve - explained.by_line < kLeastExplained) return std::nullopt;
  return map;
}

}  // namespace kvx
