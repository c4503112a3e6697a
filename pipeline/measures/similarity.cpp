// Plain sums in double precision, in the order of the pairs.
#include "pipeline/measures/similarity.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/value_range.h"

namespace kvx {
namespace {

using Histogram = Eigen::Matrix<double, kHistogramBins, kHistogramBins>;

double Entropy(const Eigen::Ref<const Eigen::ArrayXd>& probability) {
  double sum = 0;
  for (const double p : probability) {
    if (p > 0) sum -= p * std::log(p);
  }
  return sum;
}

double MutualInformation(std::span<const IntensityPair> pairs) {
  const auto bin = [](float value) {
    return std::min(kHistogramBins - 1, int(value * (kHistogramBins / 256.0f)));
  };
  auto joint = std::make_unique<Histogram>(Histogram::Zero());
  for (const IntensityPair& pair : pairs) (*joint)(bin(pair.a), bin(pair.b)) += 1;
  *joint /= double(pairs.size());
  const Eigen::ArrayXd of_a = joint->rowwise().sum().array(),
                       of_b = joint->colwise().sum().transpose().array();
  return Entropy(of_a) + Entropy(of_b) - Entropy(joint->reshaped().array());
}

}  // namespace

ByteScale ByteScaleOf(const Volume& volume) {
  const auto [low, high] = ValueRangeOf(volume.values);
  if (low > high) return {};
  if (low < -200) return {-1000.0, 255.0 / 2500.0};
  if (low >= 0 && high <= 255) return {};
  return {low, 255.0 / std::max(double(high) - double(low), 1e-9)};
}

double Correlation(std::span<const IntensityPair> pairs) {
  double mean_a = 0, mean_b = 0;
  for (const IntensityPair& pair : pairs) mean_a += pair.a, mean_b += pair.b;
  mean_a /= double(pairs.size()), mean_b /= double(pairs.size());
  double aa = 0, bb = 0, ab = 0;
  for (const IntensityPair& pair : pairs) {
    const double a = pair.a - mean_a, b = pair.b - mean_b;
    aa += a * a, bb += b * b, ab += a * b;
  }
  const double flat = 1e-12 * double(pairs.size());
  return aa > flat && bb > flat ? ab / std::sqrt(aa * bb) : 0.0;
}

Measures Similarity(std::span<const IntensityPair> pairs) {
  if (pairs.empty()) return {.ssd = 255.0};
  double squares = 0;
  for (const IntensityPair& pair : pairs) squares += (double(pair.a) - pair.b) * (double(pair.a) - pair.b);
  return {std::sqrt(squares / double(pairs.size())), Correlation(pairs), MutualInformation(pairs)};
}

}  // namespace kvx
