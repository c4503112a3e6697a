// The scan's intensities over bins of the template's: means to decide, medians to map (VBD misplaces some of
// them).
#include "pipeline/scans/contrast_map.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/numbers/quantile.h"

namespace kvx {
namespace {

constexpr int kKnots = 24;
constexpr double kTail = 0.01;           // of the template's values beyond the first and the last knot
constexpr double kLeastShare = 0.002;    // of all values, for a knot to speak for itself
constexpr double kLeastExplained = 0.1;  // more of the scan's variance than the line explains

double Mean(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

double Median(std::vector<float> values) { return TakeMedian(values); }

// Knots without enough values take the nearest ones' line.
template <class Middle>
void Fill(const std::vector<std::vector<float>>& knots, size_t total, Middle middle,
          std::vector<float>& at_knot) {
  std::vector<int> known;
  std::vector<double> level;
  for (int k = 0; k < kKnots; ++k) {
    if (double(knots[size_t(k)].size()) < kLeastShare * double(total)) continue;
    known.push_back(k);
    level.push_back(middle(knots[size_t(k)]));
  }
  for (int k = 0; k < kKnots && !known.empty(); ++k) {
    const size_t above = size_t(std::ranges::lower_bound(known, k) - known.begin());
    const size_t hi = std::min(above, known.size() - 1);
    const size_t lo = above < known.size() && known[above] > k && above > 0 ? above - 1 : hi;
    const double t = hi > lo ? double(k - known[lo]) / (known[hi] - known[lo]) : 0;
    at_knot[size_t(k)] = float((1 - t) * level[lo] + t * level[hi]);
  }
}

struct Explained {
  double by_line = 0, by_curve = 0;  // shares of the scan's variance
  double Gain() const { return by_curve - by_line; }
};

// Little more than the line explains may still be a curve: where it is much of what the line leaves. Shading
// and misplaced tissue bend greys, too, but leave more that neither explains.
struct Bend {
  double least_gain, least_of_left;
  bool IsIn(const Explained& explained) const {
    return explained.Gain() >= least_gain && explained.Gain() >= least_of_left * (1 - explained.by_line);
  }
};
constexpr Bend kBendOfAll{0.02, 0.14};      // muscle gone dark beside fat that has not
constexpr Bend kBendOfSurely{0.015, 0.11};  // of values that surely lie right

Explained Compare(const ContrastMap& map, const std::vector<float>& t, const std::vector<float>& s) {
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

// The scan's greys over those of the template.
class Curve {
 public:
  explicit Curve(const GreyPairs& pairs) : pairs_(pairs) {
    if (pairs.in_template.size() < size_t(kKnots)) return;
    std::vector<float> all = pairs.in_template;
    map_.low = TakeQuantile(all, kTail);
    map_.step = (TakeQuantile(all, 1 - kTail) - map_.low) / (kKnots - 1);
    if (!Exists()) return;
    map_.at_knot.assign(kKnots, 0.0f);
    knots_.resize(kKnots);
    for (size_t i = 0; i < pairs.in_template.size(); ++i) {
      const float at = std::clamp((pairs.in_template[i] - map_.low) / map_.step, 0.0f, float(kKnots - 1));
      knots_[size_t(std::lround(at))].push_back(pairs.in_scan[i]);
    }
  }

  bool Exists() const { return map_.step > 0; }

  Explained ByMeans() const {
    ContrastMap map = map_;
    Fill(knots_, pairs_.in_template.size(), Mean, map.at_knot);
    return Compare(map, pairs_.in_template, pairs_.in_scan);
  }

  ContrastMap ByMedians() const {
    ContrastMap map = map_;
    Fill(knots_, pairs_.in_template.size(), Median, map.at_knot);
    return map;
  }

 private:
  const GreyPairs& pairs_;
  ContrastMap map_{.low = 0, .step = 0, .at_knot = {}};
  std::vector<std::vector<float>> knots_;  // the scan's values
};

bool IsSurelyBent(const GreyPairs& surely) {
  const Curve curve(surely);
  return curve.Exists() && kBendOfSurely.IsIn(curve.ByMeans());
}

}  // namespace

float ContrastMap::operator()(float value) const {
  const float at = std::clamp((value - low) / step, 0.0f, float(at_knot.size() - 1));
  const size_t k = std::min(size_t(at), at_knot.size() - 2);
  return at_knot[k] + (at - float(k)) * (at_knot[k + 1] - at_knot[k]);
}

Volume Mapped(Volume volume, const std::optional<ContrastMap>& contrast) {
  if (!contrast) return volume;
  for (float& value : volume.values) value = (*contrast)(value);
  return volume;
}

std::optional<ContrastMap> FitContrast(const GreyPairs& pairs) {
  const Curve curve(pairs);
  if (!curve.Exists() || curve.ByMeans().Gain() < kLeastExplained) return std::nullopt;
  return curve.ByMedians();
}

std::optional<ContrastMap> FitContrast(const GreyPairs& all, const GreyPairs& surely) {
  const Curve curve(all);
  if (!curve.Exists()) return std::nullopt;
  const Explained explained = curve.ByMeans();
  const bool bent = explained.Gain() >= kLeastExplained || kBendOfAll.IsIn(explained) || IsSurelyBent(surely);
  return bent ? std::optional(curve.ByMedians()) : std::nullopt;
}

}  // namespace kvx
