// On counts in bins rather than on voxels: a fit costs the same for a phalanx and for a femur.
#include "pipeline/segmentation/mr/levels/intensity_mixture.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr int kRounds = 30;
constexpr double kUniformPart = 0.02;  // of voxels that no component explains

struct Component {
  double weight, mean, deviation;
  double At(double x) const {
    const double z = (x - mean) / deviation;
    return weight * std::exp(-0.5 * z * z) / (deviation * std::sqrt(2 * M_PI));
  }
};

double Sum(const std::vector<Component>& mixture, double x) {
  double sum = 0;
  for (const Component& c : mixture) sum += c.At(x);
  return sum;
}

void Refit(const std::vector<double>& count, double total, double least_deviation,
           std::vector<Component>& mixture) {
  const std::vector<Component> before = mixture;
  for (size_t c = 0; c < mixture.size(); ++c) {
    double weight = 0, first = 0, second = 0;
    for (int b = 0; b < IntensityCounts::kBins; ++b) {
      const double x = IntensityCounts::CentreOf(b);
      const double share = count[b] * before[c].At(x) / std::max(Sum(before, x), 1e-300);
      weight += share, first += share * x, second += share * x * x;
    }
    if (weight < 1e-9 * total) continue;
    const double mean = first / weight;
    mixture[c] = {weight / total, mean,
                  std::max(least_deviation, std::sqrt(std::max(0.0, second / weight - mean * mean)))};
  }
}

}  // namespace

int IntensityCounts::BinOf(double relative) {
  return int(std::clamp(relative * (kBins / kMostRelative), 0.0, kBins - 1.0));
}

void IntensityCounts::Add(const IntensityCounts& other, double weight) {
  for (int b = 0; b < kBins; ++b) count_[b] += weight * other.count_[b];
}

double IntensityCounts::Total() const {
  double total = 0;
  for (const double c : count_) total += c;
  return total;
}

double IntensityCounts::Quantile(double fraction) const {
  double left = fraction * Total();
  for (int b = 0; b < kBins; ++b) {
    left -= count_[b];
    if (left < 0) return CentreOf(b);
  }
  return CentreOf(kBins - 1);
}

IntensityMixture::IntensityMixture(const IntensityCounts& counts, int components, double least_deviation) {
  const double total = counts.Total();
  std::vector<Component> mixture;
  for (int c = 0; c < components && total > 0; ++c) {
    mixture.push_back({1.0 / components, counts.Quantile((c + 0.5) / components), 2 * least_deviation});
  }
  for (int round = 0; round < kRounds && total > 0; ++round)
    Refit(counts.count(), total, least_deviation, mixture);
  for (int b = 0; b < IntensityCounts::kBins; ++b) {
    const double fitted = Sum(mixture, IntensityCounts::CentreOf(b));
    log_density_.push_back(
        std::log((1 - kUniformPart) * fitted + kUniformPart / IntensityCounts::kMostRelative));
  }
}

}  // namespace kvx
