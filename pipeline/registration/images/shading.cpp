// Weighted least squares on log ratios; the weights (Tukey's) follow from the residuals of the round before.
#include "pipeline/registration/images/shading.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"

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
  Eigen::Vector3d in_box = Eigen::Vector3d::Zero();
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
    out.push_back({InBox(box, sample.x_mm), sample.scan_value / sample.template_value});
  }
  ParallelEach(out.size(), [&](size_t n) { out[n].log_ratio = std::log(out[n].log_ratio); });
  return out;
}

struct NormalEquations {
  Eigen::Matrix<double, 10, 10> normal = Eigen::Matrix<double, 10, 10>::Zero();
  Terms right = Terms::Zero();
  NormalEquations& operator+=(const NormalEquations& other) {
    normal += other.normal, right += other.right;
    return *this;
  }
};

Terms Solve(const std::vector<Row>& rows, const Terms& before, double spread) {
  auto sum = ParallelSum<NormalEquations>(rows.size(), [&](NormalEquations& so_far, size_t r) {
    const Terms terms = TermsAt(rows[r].in_box);
    const double off = (rows[r].log_ratio - terms.dot(before)) / (kReach * spread);
    if (std::abs(off) >= 1) return;
    const Terms weighted = (1 - off * off) * (1 - off * off) * terms;
    so_far.normal += weighted * terms.transpose();
    so_far.right += rows[r].log_ratio * weighted;
  });
  const double stiff = kStiff * double(rows.size());
  for (int n = 0; n < 10; ++n) sum.normal(n, n) += n == 0 ? 1e-9 : stiff;
  return sum.normal.ldlt().solve(sum.right);
}

double RobustSpread(const std::vector<Row>& rows, const Terms& fit) {
  std::vector<double> off(rows.size());
  ParallelEach(off.size(),
               [&](size_t n) { off[n] = std::abs(rows[n].log_ratio - TermsAt(rows[n].in_box).dot(fit)); });
  return std::max(kLeastSpread, kSdOfMad * TakeMedian(off));
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
  const int length = grid.size.x();
  const Eigen::ArrayXf along = Eigen::ArrayXf::LinSpaced(length, 0, float(length - 1));
  const Eigen::Matrix<float, 10, 1> c = coefficients.cast<float>();
  ParallelRanges(out.values.size() / size_t(length), [&](size_t begin, size_t end) {
    Eigen::ArrayXf x, y, z;
    for (size_t row = begin; row < end; ++row) {
      const int j = int(row % size_t(grid.size.y())), k = int(row / size_t(grid.size.y()));
      const Eigen::Vector3d first_mm = grid.ToMm(0, j, k).lps, step_mm = grid.ToMm(1, j, k).lps - first_mm;
      const Eigen::Vector3f first = (first_mm - middle_mm).cwiseQuotient(half_mm).cast<float>();
      const Eigen::Vector3f step = step_mm.cwiseQuotient(half_mm).cast<float>();
      x = (first.x() + step.x() * along).max(-1.0f).min(1.0f);
      y = (first.y() + step.y() * along).max(-1.0f).min(1.0f);
      z = (first.z() + step.z() * along).max(-1.0f).min(1.0f);
      Eigen::Map<Eigen::ArrayXf>(&out.values[row * size_t(length)], length) =
          (c[0] + x * (c[1] + c[4] * x + c[7] * y) + y * (c[2] + c[5] * y + c[8] * z) +
           z * (c[3] + c[6] * z + c[9] * x))
              .exp();
    }
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
