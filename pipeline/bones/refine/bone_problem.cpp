// Gauss-Newton sums over pairs of a template and a scan.
#include "pipeline/bones/refine/bone_problem.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/voxels/voxel_box.h"
#include "pipeline/bones/refine/trust.h"
#include "pipeline/bones/refine/weighted_correlation.h"

namespace kvx {
namespace {

using Normal = BoneProblem::Normal;

// How far tissue strays from skinning, away from the bone: several times what it does, as neighbours stray
// together and count one by one.
constexpr double kSlipPerMm = 0.5, kSlipMm = 0.15;
constexpr double kCommonSlipMm = 0.05;  // how far all of it slides along the bone together
constexpr double kMostOfCluster = 1.1;  // one cluster is never taken to hold more than ten elevenths of all
constexpr double kLeastVolume = 0.1;    // of a blend of motions: below, it cannot be followed back
constexpr double kLeastSignal = 0.02;   // part of a normal matrix that is signal in any direction

// `signal` as a part of `whole` between the least and all of it, in every direction.
Normal PartOf(Normal whole, const Normal& signal) {
  whole.diagonal().array() += 1e-9;
  const Eigen::LLT<Normal> root(whole);
  Normal relative = root.matrixL().solve(signal);
  relative = root.matrixL().solve(relative.transpose().eval());
  const Eigen::SelfAdjointEigenSolver<Normal> parts(relative);
  const BoneProblem::Row part = parts.eigenvalues().cwiseMax(kLeastSignal).cwiseMin(1.0);
  const Normal back = Normal(root.matrixL()) * parts.eigenvectors();
  return back * part.asDiagonal() * back.transpose();
}

}  // namespace

void BoneProblem::Blend::Add(double weight, const Blend& motion) {
  linear += weight * motion.linear;
  shift_mm += weight * motion.shift_mm;
}

BoneProblem::BoneProblem(const BoneTissue& tissue, const CubicImage& template_image, const CubicImage& scan,
                         const PoseVector& poses, int bone)
    : tissue_(tissue),
      alike_(LikenThickSlices(template_image.grid(), scan.grid(), poses[size_t(bone)])),
      template_image_(template_image, alike_.a_sd_mm),
      scan_(scan, alike_.b_sd_mm),
      template_vox_from_mm_(template_image.grid().VoxFromMm()),
      scan_vox_from_mm_(scan.grid().VoxFromMm()) {
  const std::vector<Blend> motions(poses.begin(), poses.end());
  others_.reserve(tissue.samples.size());
  for (const TissueSample& sample : tissue.samples) {
    Blend blend;
    for (const auto& [other, weight] : sample.others) blend.Add(weight, motions[size_t(other)]);
    others_.push_back(blend);
  }
  // Either way holds all there is to see; of a finer image, only as much as both show.
  const double of_template = template_image.grid().spacing_mm.prod() / alike_.voxel_mm3,
               of_scan = 1 / (alike_.voxel_mm3 / scan.grid().spacing_mm.prod());
  PairVoxelsOfTemplate(0.5 * std::min(1.0, of_template));
  PairVoxelsOfScan(poses[size_t(bone)], 0.5 * std::min(1.0, of_scan));
}

void BoneProblem::PairVoxelsOfTemplate(double share) {
  for (size_t s = 0; s < tissue_.samples.size(); ++s) {
    const TissueSample& sample = tissue_.samples[s];
    Pair pair{s, share, sample.from_centre_mm};
    pair.in_template = sample.value;
    pair.template_slope = sample.gradient;
    pair.trust = share;
    if (template_image_.blurs()) Blur(pair);
    pairs_.push_back(pair);
  }
}

// What the template shows of a voxel of its own.
void BoneProblem::Blur(Pair& pair) const {
  const PointMm at{tissue_.centre.lps + pair.from_centre_mm};
  Eigen::Vector3d per_voxel;
  template_image_.At(template_image_.grid().ToVox(at).ijk.array().round(), pair.in_template, per_voxel);
  pair.template_slope = template_vox_from_mm_.transpose() * per_voxel;
}

// All voxels in the box that the samples fill in the scan.
void BoneProblem::PairVoxelsOfScan(const RigidTransform& pose, double share) {
  const Grid& grid = scan_.grid();
  const Blend motion(pose);
  Eigen::Vector3d low = grid.size.cast<double>(), high = Eigen::Vector3d::Constant(-1);
  for (size_t s = 0; s < tissue_.samples.size(); ++s) {
    const Eigen::Vector3d in_template = tissue_.centre.lps + tissue_.samples[s].from_centre_mm;
    const Eigen::Vector3d at = grid.ToVox(PointMm{ScanFromTemplate(s, motion)(in_template)}).ijk;
    low = low.cwiseMin(at), high = high.cwiseMax(at);
  }
  const VoxelBox filled{low.cwiseMax(0).array().ceil().cast<int>(),
                        (high.array().floor().cast<int>() + 1).min(grid.size.array())};
  ForEachVoxel(filled, [&](const Eigen::Vector3i& voxel) { PairVoxelOfScan(voxel, motion, share); });
}

// With the sample that the voxel shows, where there is one.
void BoneProblem::PairVoxelOfScan(const Eigen::Vector3i& voxel, const Blend& pose, double share) {
  const PointMm at = scan_.grid().ToMm(PointVox{voxel.cast<double>()});
  std::optional<size_t> sample = SampleAt(pose.linear.transpose() * (at.lps - pose.shift_mm));
  if (!sample) return;
  const Blend there = ScanFromTemplate(*sample, pose);
  sample = SampleAt(there.linear.inverse() * (at.lps - there.shift_mm));
  if (!sample) return;
  Pair pair{*sample, share, Eigen::Vector3d::Zero()};
  pair.trust = share;
  pair.voxel_mm = at.lps;
  Eigen::Vector3d per_voxel;
  scan_.At(voxel.cast<double>(), pair.in_scan, per_voxel);
  pair.voxel_slope = scan_vox_from_mm_.transpose() * per_voxel;
  pairs_.push_back(pair);
}

BoneProblem::Blend BoneProblem::ScanFromTemplate(size_t sample, const Blend& pose) const {
  Blend blend = others_[sample];
  blend.Add(tissue_.samples[sample].own_weight, pose);
  return blend;
}

std::optional<size_t> BoneProblem::SampleAt(const Eigen::Vector3d& in_template_mm) const {
  const Grid& grid = tissue_.sample_at.grid;
  const Eigen::Vector3d at = grid.ToVox(PointMm{in_template_mm}).ijk.array() + 0.5;
  const Eigen::Vector3i voxel = at.array().floor().cast<int>();
  if (!grid.Contains(voxel)) return std::nullopt;
  const int32_t sample = tissue_.sample_at(voxel.x(), voxel.y(), voxel.z());
  return sample == kNoSample ? std::nullopt : std::optional<size_t>(size_t(sample));
}

void BoneProblem::Look(const RigidTransform& pose) {
  const Blend motion(pose);
  const size_t of_template = tissue_.samples.size();
  for (size_t i = 0; i < of_template; ++i) LookFromTemplate(motion, pairs_[i]);
  for (size_t i = of_template; i < pairs_.size(); ++i) LookFromScan(motion, pairs_[i]);
  FitGain();
}

void BoneProblem::LookFromTemplate(const Blend& pose, Pair& pair) const {
  const Eigen::Vector3d at = ScanFromTemplate(pair.sample, pose)(tissue_.centre.lps + pair.from_centre_mm);
  const Eigen::Vector3d in_voxels = scan_vox_from_mm_ * (at - scan_.grid().origin.lps);
  Eigen::Vector3d per_voxel;
  pair.seen = scan_.At(in_voxels, pair.in_scan, per_voxel);
  if (!pair.seen) return;
  pair.scan_slope = pose.linear.transpose() * (scan_vox_from_mm_.transpose() * per_voxel);
  pair.missed_variance = scan_.image().MissedVariance(in_voxels);
}

void BoneProblem::LookFromScan(const Blend& pose, Pair& pair) const {
  const Blend scan_from_template = ScanFromTemplate(pair.sample, pose);
  Eigen::Matrix3d template_from_scan;
  double volume;
  bool invertible;
  scan_from_template.linear.computeInverseAndDetWithCheck(template_from_scan, volume, invertible);
  pair.seen = volume > kLeastVolume;
  if (!pair.seen) return;
  const Eigen::Vector3d at = template_from_scan * (pair.voxel_mm - scan_from_template.shift_mm);
  const Eigen::Vector3d in_voxels = template_vox_from_mm_ * (at - template_image_.grid().origin.lps);
  Eigen::Vector3d per_voxel;
  pair.seen = template_image_.At(in_voxels, pair.in_template, per_voxel);
  if (!pair.seen) return;
  pair.missed_variance = template_image_.image().MissedVariance(in_voxels);
  // Identity where the bone rules.
  const Eigen::Matrix3d back = template_from_scan * pose.linear;
  pair.from_centre_mm = at - tissue_.centre.lps;
  pair.template_slope = back.transpose() * (template_vox_from_mm_.transpose() * per_voxel);
  pair.scan_slope = pose.linear.transpose() * pair.voxel_slope;
}

void BoneProblem::FitGain() {
  double sss = 0, ss = 0, n = 0, sts = 0, st = 0;
  for (const Pair& pair : pairs_) {
    if (!pair.seen) continue;
    const double w = pair.trust, s = pair.in_scan, t = pair.in_template;
    n += w, ss += w * s, sss += w * s * s, st += w * t, sts += w * s * t;
  }
  const double spread = n * sss - ss * ss;
  gain_ = spread > 1e-12 * n * n ? std::max(1e-3, (n * sts - ss * st) / spread) : 1.0;
  bias_ = n > 0 ? (st - gain_ * ss) / n : 0.0;
  for (Pair& pair : pairs_) pair.residual = pair.seen ? pair.in_template - gain_ * pair.in_scan - bias_ : 0.0;
}

// Odd for noise, what slices miss, and a little slip across the local contrast.
void BoneProblem::Trust() {
  noise_ = NoiseSd();
  const size_t of_template = tissue_.samples.size();
  for (size_t i = 0; i < pairs_.size(); ++i) {
    Pair& pair = pairs_[i];
    const double away_mm = SampleOf(pair).away_mm;
    const double slip_mm = away_mm > 0 ? kSlipMm + kSlipPerMm * away_mm : 0.0;
    const double missed = (i < of_template ? gain_ * gain_ : 1.0) * pair.missed_variance;  // template's greys
    const double variance = noise_ * noise_ + missed + pair.template_slope.squaredNorm() * slip_mm * slip_mm;
    const double odd = pair.residual * pair.residual / (kTolerance * kTolerance * variance);
    pair.trust = pair.share * noise_ * noise_ / variance * TrustAt(odd);
  }
  FitGain();
}

BoneProblem::Normal BoneProblem::Equations(Row& right) const {
  const Halves halves = Sums();
  const Softening soft = SofteningOf(halves.around.normal);
  right = halves.within.right + soft.Of(halves.around.right);
  Normal normal = halves.within.normal + soft.Of(halves.around.normal);
  normal.diagonal().array() += 1e-9;
  return normal;
}

// What the residuals' size says, and what their sums over clusters say, residuals of one cluster having one
// cause (clustered sandwich). The fit has followed each cluster's errors in part; as in a jackknife, each
// counts as if it had been left out.
Twist6Covariance BoneProblem::Covariance() const {
  const Halves signal = Signal(), whole = Sums();
  const Normal &within = signal.within.normal, &around = signal.around.normal;
  const Softening soft = SofteningOf(around);
  const Normal inverse = Normal(within + soft.Of(around)).ldlt().solve(Normal::Identity());
  Normal total = kMostOfCluster * (whole.within.normal + soft.Of(whole.around.normal));
  total.diagonal().array() += 1e-9;
  Normal scatter = Normal::Zero();
  for (const auto& [cell, cluster] : Clusters(soft)) {
    const Normal others = Normal::Identity() - cluster.normal * total.inverse();
    const Row left_out = others.partialPivLu().solve(cluster.right);
    scatter += left_out * left_out.transpose();
  }
  const Normal sandwich = inverse * scatter * inverse;
  return (ResidualVariance() * inverse + sandwich).topLeftCorner<6, 6>();
}

double BoneProblem::Correlation() const {
  WeightedCorrelation correlation;
  for (const Pair& pair : pairs_)
    if (pair.seen) correlation.Add(pair.share, pair.in_scan, pair.in_template);
  return correlation.Value();
}

double BoneProblem::SeenPart() const {
  const auto end = pairs_.begin() + std::ptrdiff_t(tissue_.samples.size());
  const auto seen = std::count_if(pairs_.begin(), end, [](const Pair& pair) { return pair.seen; });
  return double(seen) / double(std::max<size_t>(1, tissue_.samples.size()));
}

std::map<std::array<int, 3>, BoneProblem::Cluster> BoneProblem::Clusters(const Softening& soft) const {
  std::map<std::array<int, 3>, Cluster> clusters;
  for (const Pair& pair : pairs_) {
    if (!pair.seen) continue;
    Cluster& cluster = clusters[ClusterOf(pair.from_centre_mm, tissue_.voxel_mm)];
    const Row row = RowOf(pair), shown = IsAround(pair) ? soft.Of(row) : row;
    cluster.normal += pair.trust * shown * row.transpose();
    cluster.right += pair.trust * pair.residual * shown;
  }
  return clusters;
}

double BoneProblem::ResidualVariance() const {
  double squares = 0, count = 0;
  for (const Pair& pair : pairs_) {
    if (pair.seen) squares += pair.trust * pair.residual * pair.residual, count += pair.trust;
  }
  return squares / std::max(1e-9, count);
}

BoneProblem::Softening BoneProblem::SofteningOf(const Normal& around) const {
  Eigen::Matrix<double, 6, 6> held = Eigen::Matrix<double, 6, 6>::Zero();
  const double certainty = noise_ * noise_ / (kCommonSlipMm * kCommonSlipMm);
  held.topLeftCorner<3, 3>() = certainty * tissue_.lever_mm2;  // a turn moves the surface by its lever
  held.bottomRightCorner<3, 3>().diagonal().setConstant(certainty);
  const Eigen::Matrix<double, 6, 6> both = around.topLeftCorner<6, 6>() + held;
  return {both.ldlt().solve(around.topRows<6>()).transpose()};
}

BoneProblem::Halves BoneProblem::Sums() const {
  Halves halves;
  for (const Pair& pair : pairs_) {
    if (!pair.seen) continue;
    (IsAround(pair) ? halves.around : halves.within).Add(RowOf(pair), pair.trust, pair.residual);
  }
  return halves;
}

// The normal matrices without what noise adds to them: the noises of template and scan have nothing to do
// with each other, so products of one's slope with the other's hold signal only.
BoneProblem::Halves BoneProblem::Signal() const {
  Halves out = Sums();
  Normal within = Normal::Zero(), around = Normal::Zero();
  for (const Pair& pair : pairs_) {
    if (!pair.seen) continue;
    const Row a = RowWith(pair, gain_ * pair.scan_slope), b = RowWith(pair, pair.template_slope);
    (IsAround(pair) ? around : within) += pair.trust * (0.5 * (a * b.transpose() + b * a.transpose()));
  }
  out.within.normal = PartOf(out.within.normal, within);
  out.around.normal = PartOf(out.around.normal, around);
  return out;
}

// Derivative of the residual's model by the motion: the mean of both images' slopes, which halves what noise
// adds to either.
BoneProblem::Row BoneProblem::RowOf(const Pair& pair) const {
  return RowWith(pair, 0.5 * (gain_ * pair.scan_slope + pair.template_slope));
}

BoneProblem::Row BoneProblem::RowWith(const Pair& pair, const Eigen::Vector3d& slope) const {
  const Eigen::Vector3d g = SampleOf(pair).own_weight * slope;
  Row row;
  row << pair.from_centre_mm.cross(g), g, pair.in_scan, 1.0;
  return row;
}

double BoneProblem::NoiseSd() const {
  std::vector<double> sizes;
  for (const Pair& pair : pairs_) {
    if (pair.seen) sizes.push_back(std::abs(pair.residual));
  }
  if (sizes.empty()) return 1e-6;
  return UsualResidual(sizes);
}

}  // namespace kvx
