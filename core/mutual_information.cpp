// The joint histogram in one pass, and its entropies.
#include "core/mutual_information.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kvx {
namespace {

constexpr int kBins = kMutualInformationBins;
constexpr double kFlatNats = 1e-3;  // marginal entropy below which an image says nothing

struct Histogram {
  std::array<double, kBins * kBins> joint{};  // template bin major
  std::array<double, kBins> of_template{}, of_scan{};
  double total = 0;
};

struct Window {
  int bin = 0;       // and the next one
  double upper = 0;  // share of the next one
};

Window WindowAt(float value, const IntensityRange& range) {
  const double width = (double(range.high) - range.low) / (kBins - 1);
  if (!(width > 0)) return {};
  const double at = std::clamp((double(value) - range.low) / width, 0.0, double(kBins - 1));
  const int bin = std::min(int(at), kBins - 2);
  return {bin, at - bin};
}

double Log(double p) { return p > 0 ? std::log(p) : 0.0; }

double Entropy(std::span<const double> shares) {
  double sum = 0;
  for (const double p : shares) sum -= p * Log(p);
  return sum;
}

void Normalise(Histogram& h) {
  for (double& p : h.joint) p /= h.total;
  for (int a = 0; a < kBins; ++a) {
    for (int b = 0; b < kBins; ++b) {
      h.of_template[a] += h.joint[kBins * a + b];
      h.of_scan[b] += h.joint[kBins * a + b];
    }
  }
}

}  // namespace

MutualInformation EstimateMutualInformation(std::span<const float> template_values,
                                            std::span<const float> scan_values,
                                            std::span<const float> weights,
                                            const IntensityRange& template_range,
                                            const IntensityRange& scan_range) {
  Histogram h;
  for (size_t n = 0; n < weights.size(); ++n) {
    if (weights[n] <= 0) continue;
    const Window t = WindowAt(template_values[n], template_range), s = WindowAt(scan_values[n], scan_range);
    double* at = &h.joint[kBins * t.bin + s.bin];
    const double low = weights[n] * (1 - t.upper), high = weights[n] * t.upper;
    at[0] += low * (1 - s.upper), at[1] += low * s.upper;
    at[kBins] += high * (1 - s.upper), at[kBins + 1] += high * s.upper;
    h.total += weights[n];
  }
  MutualInformation out{.normalised = 1};
  if (h.total <= 0) return out;
  Normalise(h);
  const double t_entropy = Entropy(h.of_template), s_entropy = Entropy(h.of_scan);
  out.nats = std::max(0.0, t_entropy + s_entropy - Entropy(h.joint));
  out.smaller_entropy_nats = std::min(t_entropy, s_entropy);
  if (out.smaller_entropy_nats < kFlatNats) return out;
  out.normalised = out.nats / out.smaller_entropy_nats;
  return out;
}

}  // namespace kvx
