// Weighted least squares on log ratios; the weights (Tukey's) follow from the residuals of the round before.
#include "pipeline/registration/shading.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace kvx {
namespace {

using Terms = Eigen::Matrix<double, 10, 1>;
constexpr int kRounds = 6;
constexpr size_t kLeastSamples = 500;
constexpr double kDark = 0.4;  // of the mean: air and cortical bone have no ratio
constexpr double kReach = 3;   // weights end at that many robust deviations
constexpr double kLeastSpread = 0.02;
constexpr double kStiff = 1e-3;  // prior precision of a coefficient, per sample

Terms TermsAt(const Eigen::Vector3d& p) {
  Terms out;
  out << 1, p.x(), p.y(), p.z(), p.x() * p.x(), p.y() * p.y(), p.z() * p.z(), p.x() * p.y(), p.y() * p.z(),
      p.z() * p.x();
  return out;
}

Eigen::Vector3d InBox(const Shading& shading, const Eigen::Vector3d& x_mm) {
  return (x_mm - shading.middle_mm).cwiseQuotient(shading.half_mm).cwiseMax(-1.0).cwiseMin(1.0);
}

struct Row {
  Terms terms;
  double log_ratio = 0;
};

std::vector<Row> Rows(std::span<const ShadingSample> samples, const Shading& box) {
  double t = 0, s = 0;
  for (const ShadingSample& sample : samples) t += sample.template_value, s += sample.scan_value;
  const double least_t = kDark * t / double(samples.size()),
               least_s = 0.5 * kDark * s / double(samples.size());
  std::vector<Row> out;
  for (const ShadingSample& sample : samples) {
    if (!(sample.template_value > least_t && sample.scan_value > least_s && least_s > 0)) continue;
    out.push_back({TermsAt(InBox(box, sample.x_mm)), std::log(sample.scan_value / sample.template_value)});
  }
  return out;
}

Terms Solve(const std::vector<Row>& rows, const Terms& before, double spread) {
  Eigen::Matrix<double, 10, 10> normal =
      Eigen::Matrix<double, 10, 10>::Identity() * (kStiff * double(rows.size()));
  normal(0, 0) = 1e-9;
  Terms right = Terms::Zero();
  for (const Row& row : rows) {
    const double off = (row.log_ratio - row.terms.dot(before)) / (kReach * spread);
    const double weight = std::abs(off) < 1 ? (1 - off * off) * (1 - off * off) : 0;
    normal += weight * row.terms * row.terms.transpose();
    right += weight * row.log_ratio * row.terms;
  }
  return normal.ldlt().solve(right);
}

double RobustSpread(const std::vector<Row>& rows, const Terms& fit) {
  std::vector<double> off;
  for (const Row& row : rows) off.push_back(std::abs(row.log_ratio - row.terms.dot(fit)));
  const auto middle = off.begin() + std::ptrdiff_t(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  return std::max(kLeastSpread, 1.4826 * *middle);
}

Shading BoxOf(std::span<const ShadingSample> samples) {
  Eigen::Vector3d lo = samples[0].x_mm, hi = lo;
  for (const ShadingSample& sample : samples) lo = lo.cwiseMin(sample.x_mm), hi = hi.cwiseMax(sample.x_mm);
  Shading out;
  out.middle_mm = (lo + hi) / 2;
  out.half_mm = ((hi - lo) / 2).cwiseMax(1.0);
  return out;
}

}  // namespace

double Shading::At(const Eigen::Vector3d& x_mm) const {
  return std::exp(TermsAt(InBox(*this, x_mm)).dot(coefficients));
}

Volume Shading::On(const Grid& grid) const {
  Volume out(grid);
  ParallelRanges(out.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v)
      out.values[v] = float(At(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps));
  });
  return out;
}

std::optional<Shading> FitShading(std::span<const ShadingSample> samples) {
  if (samples.size() < kLeastSamples) return std::nullopt;
  Shading out = BoxOf(samples);
  const std::vector<Row> rows = Rows(samples, out);
  if (rows.size() < kLeastSamples) return std::nullopt;
  double spread = 100;  // the first round takes all alike
  for (int round = 0; round < kRounds; ++round) {
    out.coefficients = Solve(rows, out.coefficients, spread);
    spread = RobustSpread(rows, out.coefficients);
  }
  if (!out.coefficients.allFinite()) return std::nullopt;
  return out;
}

}  // namespace kvx
