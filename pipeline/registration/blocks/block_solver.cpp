// Small dense systems on the host, in double precision.
#include "pipeline/registration/blocks/block_solver.h"

#include <algorithm>
#include <cmath>

#include "pipeline/registration/blocks/level_greys.h"
#include "pipeline/registration/images/usual_residual.h"

namespace kvx {
namespace {

constexpr int kSteps = 3 * kControlPoints;
constexpr double kStepCap = 0.35;  // block widths; det J of a step stays positive up to 0.42
// Prior of the local gain, and of the bias in units of the template's contrast
constexpr double kGainSpread = 0.2;

using System = Eigen::Matrix<double, kSteps + 2, kSteps + 2>;
using Vector = Eigen::Matrix<double, kSteps + 2, 1>;
using StepMatrix = Eigen::Matrix<double, kSteps, kSteps>;

constexpr int kPair[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

StepMatrix DataMatrix(std::span<const float> equations) {
  StepMatrix h;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int a = 0; a < kControlPoints; ++a) {
        for (int b = 0; b < kControlPoints; ++b) {
          h(8 * i + a, 8 * j + b) = equations[64 * kPair[i][j] + 8 * a + b];
        }
      }
    }
  }
  return h;
}

// The three components of channel group g (0: J s, 1: J t, 2: J, 3: bending force).
Eigen::Matrix<double, kSteps, 1> Group(std::span<const float> equations, int g) {
  Eigen::Matrix<double, kSteps, 1> out;
  for (int n = 0; n < kSteps; ++n) out[n] = equations[384 + 24 * g + n];
  return out;
}

double Contrast(const BlockLevel& level) {
  const auto [w, sum, squares] = SumsOf(level);
  return w > 0 ? std::sqrt(std::max(1e-6, squares / w - sum * sum / (w * w))) : 1.0;
}

// Energy of a spline that bends alike in all directions of the voxels' lattice, in parts of what it would be
// on cubes of the same volume: squared laplacians of such waves hold a fifth of the fourth powers of the
// axes' curvatures, and a fifteenth of their products.
double BendingOfVoxels(const Grid& grid) {
  const Eigen::Array3d q = (grid.spacing_mm / grid.MeanSpacingMm()).array().square().inverse();
  return q.square().sum() / 5 + 2 * (q[0] * q[1] + q[1] * q[2] + q[2] * q[0]) / 15;
}

struct Reduced {  // normal equations of the displacements alone, gain and bias eliminated
  StepMatrix matrix;
  Eigen::Matrix<double, kSteps, 1> right;
};

Reduced WithoutGains(std::span<const float> equations, double gain_precision, double bias_precision) {
  const auto sum = [&](int n) { return double(equations[480 + n]); };
  Eigen::Matrix<double, kSteps, 2> cross;
  cross << -Group(equations, 1), -Group(equations, 2);
  Eigen::Matrix2d gains;
  gains << sum(3) + gain_precision, sum(1), sum(1), sum(0) + bias_precision;
  const Eigen::Vector2d gains_right(sum(4) + gain_precision, sum(2));
  const Eigen::Matrix<double, 2, kSteps> removed = gains.ldlt().solve(cross.transpose());
  return {DataMatrix(equations) - cross * removed,
          -Group(equations, 0) - cross * gains.ldlt().solve(gains_right)};
}

}  // namespace

BlockSolver::BlockSolver(const BlockSpline& spline, const BlockLevel& level) {
  const double radius_mm = 0.5 * kSupportVoxels * level.grid.MeanSpacingMm();
  of_cubes_ = spline.BendingEnergy() * (level.bending / radius_mm);
  bending_ = of_cubes_ * BendingOfVoxels(level.grid);
  gain_precision_ = 1 / (kGainSpread * kGainSpread);
  bias_precision_ = gain_precision_ / std::pow(Contrast(level), 2);
  step_cap_mm_ = kStepCap * kBlockVoxels * level.grid.spacing_mm.minCoeff();
}

BlockStep BlockSolver::Solve(std::span<const float> equations, double firmness) const {
  StepMatrix prior = StepMatrix::Zero();
  for (int i = 0; i < 3; ++i) prior.block<8, 8>(8 * i, 8 * i) = firmness * bending_;
  const Reduced data = WithoutGains(equations, gain_precision_, bias_precision_);
  const Eigen::Matrix<double, kSteps, 1> force = Group(equations, 3);
  const Eigen::LLT<StepMatrix> solver(data.matrix + prior);
  Eigen::Matrix<double, kSteps, 1> f = solver.solve(data.right - force);
  BlockStep step;
  if (solver.info() != Eigen::Success || !f.allFinite()) return step;
  for (int a = 0; a < kControlPoints; ++a) {
    step.largest_mm = std::max(step.largest_mm, Eigen::Vector3d(f[a], f[8 + a], f[16 + a]).norm());
  }
  if (step.largest_mm > step_cap_mm_) {
    f *= step_cap_mm_ / step.largest_mm;
    step.largest_mm = step_cap_mm_;
  }
  for (int n = 0; n < kSteps; ++n) step.displacement_mm[n] = float(f[n]);
  step.data_gain = f.dot(data.right) - 0.5 * f.dot(data.matrix * f);
  step.bending_change = f.dot(force) + 0.5 * f.dot(prior * f);
  return step;
}

std::vector<float> BlockSolver::VariancesMm2(std::span<const float> equations, double firmness,
                                             std::span<const std::array<float, kControlPoints>> basis) const {
  StepMatrix prior = StepMatrix::Zero();
  for (int i = 0; i < 3; ++i) prior.block<8, 8>(8 * i, 8 * i) = firmness * of_cubes_;
  const Reduced data = WithoutGains(equations, gain_precision_, bias_precision_);
  const StepMatrix with_data = (data.matrix + prior).llt().solve(StepMatrix::Identity());
  const double residual = 2 * DataEnergyPerWeight(equations.subspan(480, kSumChannels));
  const double doubt = std::max(1.0, residual / kUsualResidual);
  std::vector<float> out;
  for (const auto& row : basis) {
    const ControlRow phi =
        Eigen::Map<const Eigen::Matrix<float, 1, kControlPoints>>(row.data()).cast<double>();
    double trace = 0;
    for (int i = 0; i < 3; ++i) trace += phi.dot(phi * with_data.block<8, 8>(8 * i, 8 * i).transpose());
    out.push_back(float(doubt * trace));
  }
  return out;
}

double BlockSolver::DataEnergyPerWeight(std::span<const float> sums) const {
  const double w = sums[0], t = sums[1], s = sums[2], tt = sums[3], ts = sums[4], ss = sums[5];
  if (w <= 0) return 0;
  Eigen::Matrix2d gains;
  gains << tt + gain_precision_, t, t, w + bias_precision_;
  const Eigen::Vector2d right(ts + gain_precision_, s);
  const double left = ss + gain_precision_ - right.dot(gains.ldlt().solve(right));
  return 0.5 * std::max(0.0, left) / w;
}

}  // namespace kvx
