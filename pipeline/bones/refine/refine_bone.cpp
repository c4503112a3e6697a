// Levenberg-Marquardt with gain and bias eliminated by least squares.
#include "pipeline/bones/refine/refine_bone.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

#include "pipeline/bones/refine/pose_equations.h"
#include "pipeline/bones/refine/trust.h"

namespace kvx {
namespace {

using Row = PoseEquations::Row;  // rotation about the bone's centre, shift, gain, bias
using Normal = PoseEquations::Normal;

// Trilinear value and its gradient per voxel. False outside the hull of voxel centres.
bool SampleWithGradient(const Volume& volume, const Eigen::Vector3d& p, double& value,
                        Eigen::Vector3d& gradient) {
  const Grid& grid = volume.grid;
  int lo[3], step[3];
  double f[3];
  for (int a = 0; a < 3; ++a) {
    if (!(p[a] >= 0 && p[a] <= grid.size[a] - 1)) return false;
    lo[a] = std::clamp(int(p[a]), 0, std::max(0, grid.size[a] - 2));
    step[a] = grid.size[a] > 1;
    f[a] = p[a] - lo[a];
  }
  const size_t sx = step[0], sy = size_t(step[1]) * grid.size.x(),
               sz = size_t(step[2]) * grid.size.x() * grid.size.y();
  const float* v = volume.values.data() + grid.Index(lo[0], lo[1], lo[2]);
  const double x00 = v[0] + f[0] * (v[sx] - v[0]), x10 = v[sy] + f[0] * (v[sy + sx] - v[sy]);
  const double x01 = v[sz] + f[0] * (v[sz + sx] - v[sz]),
               x11 = v[sz + sy] + f[0] * (v[sz + sy + sx] - v[sz + sy]);
  const double y0 = x00 + f[1] * (x10 - x00), y1 = x01 + f[1] * (x11 - x01);
  value = y0 + f[2] * (y1 - y0);
  const double d00 = v[sx] - v[0], d10 = v[sy + sx] - v[sy], d01 = v[sz + sx] - v[sz],
               d11 = v[sz + sy + sx] - v[sz + sy];
  const double d0 = d00 + f[1] * (d10 - d00), d1 = d01 + f[1] * (d11 - d01);
  gradient = {d0 + f[2] * (d1 - d0), (x10 - x00) + f[2] * ((x11 - x01) - (x10 - x00)), y1 - y0};
  return true;
}

// Sums of one pass over the samples at a pose.
struct Pass {
  PoseEquations equations;
  PoseFit fit;
};

Pass PassAt(const Volume& scan, const BoneSamples& samples, const RigidTransform& pose, bool with_normal) {
  const bool weighted = samples.weights.size() == samples.points.size();
  Pass pass;
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  const Eigen::Matrix3d vox_from_mm = scan.grid.VoxFromMm(), vox_rotation = vox_from_mm * rotation;
  const Eigen::Vector3d centre_vox = scan.grid.ToVox(pose * PointMm{samples.centre_mm}).ijk;
  double n = 0, st = 0, stt = 0, ss = 0, sss = 0, sts = 0;
  for (size_t i = 0; i < samples.points.size(); ++i) {
    const BoneSample& sample = samples.points[i];
    const double w = weighted ? samples.weights[i] : 1.0;
    const Eigen::Vector3d x = sample.head<3>().cast<double>();
    double s;
    Eigen::Vector3d per_voxel;
    if (!SampleWithGradient(scan, centre_vox + vox_rotation * x, s, per_voxel)) continue;
    const double t = sample.w();
    n += w, st += w * t, stt += w * t * t, ss += w * s, sss += w * s * s, sts += w * s * t;
    if (!with_normal) continue;
    const Eigen::Vector3d g = vox_from_mm.transpose() * per_voxel;  // for gain 1; see ScaleMotion
    Row row;
    row << (rotation * x).cross(g), g, s, 1.0;
    pass.equations.Add(row, w, t);
  }
  pass.fit.scan_from_template = pose;
  pass.fit.inside = n / (weighted ? std::accumulate(samples.weights.begin(), samples.weights.end(), 1e-12)
                                  : double(std::max<size_t>(1, samples.points.size())));
  const CorrelationSums sums{float(n), float(st), float(stt), float(ss), float(sss), float(sts)};
  pass.fit.correlation = Correlation(sums);
  return pass;
}

double Goodness(const PoseFit& fit) { return EvidenceNats(fit.correlation, fit.inside, 1.0); }

// Rotation about the bone's centre and a shift.
RigidTransform Moved(const RigidTransform& pose, const Eigen::Vector3d& centre_mm, const Row& step) {
  const PointMm centre = pose * PointMm{centre_mm};
  RigidTransform turn = RotationAbout(centre, step.head<3>(), step.head<3>().norm());
  turn.translation_mm += step.segment<3>(3);
  return turn * pose;
}

double RadiusMm(const BoneSamples& samples) {
  double squares = 0;
  for (const BoneSample& sample : samples.points) squares += sample.head<3>().squaredNorm();
  return std::max(1e-3, std::sqrt(squares / double(std::max<size_t>(1, samples.points.size()))));
}

// How far a step takes the bone's voxels.
double MovedMm(const Row& step, double radius_mm) {
  return std::max(step.segment<3>(3).norm(), step.head<3>().norm() * radius_mm);
}

// The damped step for the motion; gain and bias are free.
Row SolveStep(const PoseEquations& equations, double gain, double bias, double damping, double radius_mm,
              double limit_mm) {
  Normal normal = equations.normal;
  const double trace = normal.block<3, 3>(3, 3).trace() / 3 + 1e-12;
  for (int a = 0; a < 3; ++a)
    normal(a, a) += damping * trace * radius_mm * radius_mm, normal(3 + a, 3 + a) += damping * trace;
  normal(6, 6) += 1e-9, normal(7, 7) += 1e-9;
  Row now = Row::Zero();
  now[6] = gain, now[7] = bias;
  // residual t - a s - b at the present pose; columns 6 and 7 refit gain and bias together with the step
  const Row solved = normal.ldlt().solve(equations.right - equations.normal * now);
  Row step = solved;
  const double length = MovedMm(step, radius_mm);
  if (length > limit_mm) step *= limit_mm / length;
  return step;
}

struct GainBias {
  double gain, bias;
};

// Least squares of t on s from the sums that the normal matrix already holds.
GainBias BestGain(const PoseEquations& equations) {
  Eigen::Matrix2d m = equations.normal.bottomRightCorner<2, 2>();
  m.diagonal().array() += 1e-9;
  const Eigen::Vector2d solved = m.ldlt().solve(equations.right.tail<2>());
  return {std::max(1e-3, solved[0]), solved[1]};
}

// The rows were built for gain 1: scale the motion's columns.
void ScaleMotion(PoseEquations& equations, double gain) {
  equations.normal.topRows<6>() *= gain;
  equations.normal.leftCols<6>() *= gain;
  equations.right.head<6>() *= gain;
}

}  // namespace

PoseFit FitAt(const Volume& scan, const BoneSamples& samples, const RigidTransform& pose) {
  return PassAt(scan, samples, pose, false).fit;
}

std::vector<float> TrustOf(const Volume& scan, const BoneSamples& samples, const RigidTransform& pose) {
  const auto [gain, bias] = BestGain(PassAt(scan, samples, pose, true).equations);
  const VoxFromSample vox_from_sample = ToScanVoxels(scan.grid, pose, samples.centre_mm);
  std::vector<float> residuals, sizes;
  for (const BoneSample& sample : samples.points) {
    const PointVox p{
        (vox_from_sample.leftCols<3>() * sample.head<3>() + vox_from_sample.col(3)).cast<double>()};
    const bool seen = scan.grid.Contains(p);
    residuals.push_back(seen ? float(sample.w() - gain * SampleTrilinear(scan, p) - bias) : 0.0f);
    if (seen) sizes.push_back(std::abs(residuals.back()));
  }
  if (sizes.empty()) return {};
  const float usual = UsualResidual(sizes);
  for (float& residual : residuals) {
    const float odd = residual / (float(kTolerance) * usual);
    residual = TrustAt(odd * odd);
  }
  return residuals;
}

PoseFit RefinePose(const Volume& scan, const BoneSamples& samples, const RigidTransform& start,
                   int iterations) {
  const double radius_mm = RadiusMm(samples), voxel_mm = scan.grid.MeanSpacingMm();
  double damping = 1e-3;
  Pass pass = PassAt(scan, samples, start, true);
  for (int i = 0; i < iterations; ++i) {
    const auto [gain, bias] = BestGain(pass.equations);
    PoseEquations scaled = pass.equations;
    ScaleMotion(scaled, gain);
    bool better = false;
    for (int attempt = 0; attempt < 4 && !better; ++attempt) {
      const Row step = SolveStep(scaled, gain, bias, damping, radius_mm, 1.5 * voxel_mm);
      const RigidTransform moved = Moved(pass.fit.scan_from_template, samples.centre_mm, step);
      const bool goes_on = i + 1 < iterations;
      // After a step that was none, the next is seldom one either, and its equations are not needed.
      const bool likely = attempt == 0;
      Pass next = PassAt(scan, samples, moved, goes_on && likely);
      better = Goodness(next.fit) > Goodness(pass.fit);
      damping = std::clamp(better ? damping * 0.3 : damping * 10, 1e-5, 1e3);
      if (!better) continue;
      if (MovedMm(step, radius_mm) < 2e-3 * voxel_mm) return next.fit;
      pass = goes_on && !likely ? PassAt(scan, samples, moved, true) : next;
    }
    if (!better) break;
  }
  return pass.fit;
}

RigidTransform RefinePoseRobustly(const Volume& scan, const BoneSamples& samples, const RigidTransform& start,
                                  int rounds) {
  RigidTransform pose = start;
  BoneSamples trusted = samples;
  for (int round = 0; round < rounds; ++round) {
    trusted.weights = TrustOf(scan, trusted, pose);
    pose = RefinePose(scan, trusted, pose, 6).scan_from_template;
  }
  return pose;
}

}  // namespace kvx
