// Plain sums in double precision, always of the same parts of the pairs.
#include "pipeline/measures/similarity.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include "core/host/parallel.h"
#include "core/numbers/value_range.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

constexpr float kLeastByteRange = 16;  // what hardly reaches it is no image of bytes: most are floats up to 1

constexpr double kRounding = 1e-7;     // of a float: an image that ranges over less is flat
constexpr double kLeastRange = 1e-40;  // of an image of zeros

using Histogram = Eigen::Matrix<double, kHistogramBins, kHistogramBins>;

// of_pair(pair) -> a sum's terms.
template <int kTerms, class OfPair>
Eigen::Array<double, kTerms, 1> SumOver(std::span<const IntensityPair> pairs, const OfPair& of_pair) {
  struct Sum {
    Eigen::Array<double, kTerms, 1> terms = Eigen::Array<double, kTerms, 1>::Zero();
    Sum& operator+=(const Sum& other) {
      terms += other.terms;
      return *this;
    }
  };
  return ParallelSum<Sum>(pairs.size(), [&](Sum& so_far, size_t n) { so_far.terms += of_pair(pairs[n]); })
      .terms;
}

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
  if (volume.values.empty()) return {};
  if (IsHounsfield(volume, "")) return {-1000.0, 255.0 / 2500.0};
  const ValueRange usual = UsualRangeOf(volume.values);
  if (usual.least >= 0 && usual.most <= 255 && usual.most >= kLeastByteRange) return {};
  const auto [low, high] = RangeWithoutStraysOf(volume.values);
  const double rounding = kRounding * std::max(std::abs(double(low)), std::abs(double(high)));
  return {low, 255.0 / std::max({double(high) - double(low), rounding, kLeastRange})};
}

double Correlation(std::span<const IntensityPair> pairs) {
  const double count = double(pairs.size());
  const Eigen::Array2d mean =
      SumOver<2>(pairs, [](const IntensityPair& pair) { return Eigen::Array2d(pair.a, pair.b); }) / count;
  const Eigen::Array3d moments = SumOver<3>(pairs, [&](const IntensityPair& pair) {
    const double a = pair.a - mean[0], b = pair.b - mean[1];
    return Eigen::Array3d(a * a, b * b, a * b);
  });
  const auto [aa, bb, ab] = std::tuple(moments[0], moments[1], moments[2]);
  const double flat = 1e-12 * count;
  return aa > flat && bb > flat ? ab / std::sqrt(aa * bb) : 0.0;
}

Measures Similarity(std::span<const IntensityPair> pairs) {
  if (pairs.empty()) return {.ssd = 255.0};
  const auto squares = SumOver<1>(
      pairs, [](const IntensityPair& pair) { return (double(pair.a) - pair.b) * (double(pair.a) - pair.b); });
  return {std::sqrt(squares[0] / double(pairs.size())), Correlation(pairs), MutualInformation(pairs)};
}

}  // namespace kvx
