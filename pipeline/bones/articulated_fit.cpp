// Rounds of damped Gauss-Newton steps; every round sees the poses of the round before, so bones run side by
// side.
#include "pipeline/bones/articulated_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "core/parallel.h"
#include "pipeline/bones/distance_map.h"

namespace kvx {
namespace {

constexpr double kMarginMm = 3.0, kMarginVoxels = 1.5;  // of tissue around a bone, the larger of the two
constexpr size_t kMostSamples = 12000;
constexpr double kSlipPerMm = 0.15,
                 kSlipMm = 0.05;        // how far tissue strays from skinning, away from the bone
constexpr double kCommonSlipMm = 0.05;  // how far all of it slides along the bone together
constexpr double kTolerance = 2.0;  // residuals in standard deviations at which trust has fallen to a quarter
constexpr int kRounds = 3, kSteps = 8;
constexpr double kClusterMm = 10.0;  // about a finger bone's thickness: residuals so near may have one cause
constexpr double kMostOfCluster = 1.1;  // one cluster is never taken to hold more than ten elevenths of all

using Row = Eigen::Matrix<double, 8, 1>;  // turn about the centroid, shift (template frame), gain, bias
using Normal = Eigen::Matrix<double, 8, 8>;

uint64_t Scatter(uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  return x ^ (x >> 27);
}

void KeepEvenly(std::vector<size_t>& voxels) {
  if (voxels.size() <= kMostSamples) return;
  std::nth_element(voxels.begin(), voxels.begin() + kMostSamples, voxels.end(),
                   [](size_t a, size_t b) { return Scatter(a) < Scatter(b); });
  voxels.resize(kMostSamples);
  std::sort(voxels.begin(), voxels.end());
}

TissueSample SampleAt(const CubicImage& image, const Eigen::Vector3i& at, const Eigen::Vector3d& centre_mm) {
  TissueSample sample;
  Eigen::Vector3d per_voxel;
  image.At(at.cast<double>(), sample.value, per_voxel);
  sample.gradient = image.grid().VoxFromMm().transpose() * per_voxel;
  sample.from_centre_mm = image.grid().ToMm(PointVox{at.cast<double>()}).lps - centre_mm;
  return sample;
}

void Weigh(const VoxelWeights& weights, int bone, TissueSample& sample) {
  sample.own_weight = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (weights.weights[s] <= 0) continue;
    if (weights.bones[s] == bone)
      sample.own_weight = weights.weights[s];
    else
      sample.others.emplace_back(weights.bones[s], weights.weights[s]);
  }
}

BoneTissue TissueOf(const BoneSet& bones, int b, const CubicImage& image, const WeightMap& weights) {
  const Bone& bone = bones.bones[b];
  const Grid& grid = bones.labels.grid;
  BoneTissue tissue{bone.centroid, 0, grid.MeanSpacingMm(), Eigen::Matrix3d::Zero(), {}};
  const double margin_mm = std::max(kMarginMm, kMarginVoxels * tissue.voxel_mm);
  const Volume distance = SignedDistance(bones.labels, bone.label, margin_mm);
  std::vector<size_t> near;
  for (size_t v = 0; v < distance.values.size(); ++v) {
    if (distance.values[v] <= margin_mm) near.push_back(v);
  }
  const Eigen::Vector3d low = grid.ToVox(distance.grid.origin).ijk;
  const Eigen::Vector3i offset = (low.array() + 0.5).floor().cast<int>().matrix();
  std::erase_if(near, [&](size_t v) {
    const Eigen::Vector3i at = distance.grid.Ijk(v) + offset;
    if (!grid.Contains(at)) return true;
    const int label = bones.labels(at.x(), at.y(), at.z());
    return label != 0 && label != bone.label;
  });
  KeepEvenly(near);
  double squares = 0;
  size_t inside = 0, around = 0;
  for (const size_t v : near) {
    const Eigen::Vector3i at = distance.grid.Ijk(v) + offset;
    TissueSample sample = SampleAt(image, at, bone.centroid.lps);
    sample.away_mm = std::max(0.0, double(distance.values[v]));
    Weigh(weights(at.x(), at.y(), at.z()), b, sample);
    if (distance.values[v] < 0) squares += sample.from_centre_mm.squaredNorm(), ++inside;
    if (sample.away_mm > 0) {
      const Eigen::Vector3d& r = sample.from_centre_mm;
      tissue.lever_mm2 += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose(), ++around;
    }
    tissue.samples.push_back(std::move(sample));
  }
  tissue.radius_mm = std::max(1e-3, std::sqrt(squares / double(std::max<size_t>(1, inside))));
  tissue.lever_mm2 /= double(std::max<size_t>(1, around));
  return tissue;
}

// One bone against one scan, its neighbours held.
class BoneProblem {
 public:
  BoneProblem(const BoneTissue& tissue, const CubicImage& scan, const PoseVector& poses)
      : tissue_(tissue), scan_(scan), trust_(tissue.samples.size(), 1.0) {
    for (const TissueSample& sample : tissue.samples) {
      const PointMm x{tissue.centre.lps + sample.from_centre_mm};
      Eigen::Vector3d rest = Eigen::Vector3d::Zero();
      for (const auto& [other, weight] : sample.others) rest += weight * (poses[other] * x).lps;
      rest_.push_back(rest);
    }
    value_.resize(rest_.size());
    gradient_.resize(rest_.size());
    seen_.resize(rest_.size());
    residual_.resize(rest_.size());
  }

  void Look(const RigidTransform& pose) {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    const Eigen::Matrix3d vox_from_mm = scan_.grid().VoxFromMm(), mm_transposed = vox_from_mm.transpose();
    const Eigen::Vector3d centre = (pose * tissue_.centre).lps;
    double sss = 0, ss = 0, n = 0, sts = 0, st = 0;
    for (size_t i = 0; i < rest_.size(); ++i) {
      const TissueSample& sample = tissue_.samples[i];
      const Eigen::Vector3d at = sample.own_weight * (centre + rotation * sample.from_centre_mm) + rest_[i];
      Eigen::Vector3d per_voxel;
      seen_[i] = scan_.At(scan_.grid().ToVox(PointMm{at}).ijk, value_[i], per_voxel);
      if (!seen_[i]) continue;
      gradient_[i] = rotation.transpose() * (mm_transposed * per_voxel);
      const double w = trust_[i], s = value_[i], t = sample.value;
      n += w, ss += w * s, sss += w * s * s, st += w * t, sts += w * s * t;
    }
    const double spread = n * sss - ss * ss;
    gain_ = spread > 1e-12 * n * n ? std::max(1e-3, (n * sts - ss * st) / spread) : 1.0;
    bias_ = n > 0 ? (st - gain_ * ss) / n : 0.0;
    for (size_t i = 0; i < rest_.size(); ++i) {
      residual_[i] = seen_[i] ? tissue_.samples[i].value - gain_ * value_[i] - bias_ : 0.0;
    }
  }

  // Less where the residual is odd for noise and a little slip across the local contrast.
  void Trust() {
    const double noise = noise_ = NoiseSd();
    for (size_t i = 0; i < rest_.size(); ++i) {
      const TissueSample& sample = tissue_.samples[i];
      const double slip_mm = sample.away_mm > 0 ? kSlipMm + kSlipPerMm * sample.away_mm : 0.0;
      const double variance = noise * noise + sample.gradient.squaredNorm() * slip_mm * slip_mm;
      const double odd = residual_[i] * residual_[i] / (kTolerance * kTolerance * variance);
      trust_[i] = noise * noise / variance / ((1 + odd) * (1 + odd));  // Geman-McClure
    }
  }

  // Gauss-Newton for the bone's motion, gain and bias, the slip of the surroundings eliminated.
  Normal Equations(Row& right) const {
    const Halves halves = Sums();
    const Softening soft = SofteningOf(halves.around);
    right = halves.right_within + soft.Of(halves.right_around);
    Normal normal = halves.within + soft.Of(halves.around);
    normal.diagonal().array() += 1e-9;
    return normal;
  }

  // Spread of the estimate: what the residuals' size says, and what their sums over clusters say, residuals
  // of one cluster having one cause (clustered sandwich). The fit has followed each cluster's errors in part;
  // as in a jackknife, each counts as if it had been left out.
  Twist6Covariance Covariance() const {
    const Halves signal = Signal(), whole = Sums();
    const Softening soft = SofteningOf(signal.around);
    const Normal inverse = Normal(signal.within + soft.Of(signal.around)).ldlt().solve(Normal::Identity());
    Normal total = kMostOfCluster * (whole.within + soft.Of(whole.around));
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

  double Correlation() const {
    double n = 0, s = 0, t = 0, ss = 0, tt = 0, st = 0;
    for (size_t i = 0; i < rest_.size(); ++i) {
      if (!seen_[i]) continue;
      const double a = value_[i], b = tissue_.samples[i].value;
      n += 1, s += a, t += b, ss += a * a, tt += b * b, st += a * b;
    }
    const double spread = (n * ss - s * s) * (n * tt - t * t);
    return spread > 0 ? (n * st - s * t) / std::sqrt(spread) : 0.0;
  }

 private:
  // What samples of the bone itself and samples around it say.
  struct Halves {
    Normal within = Normal::Zero(), around = Normal::Zero();
    Row right_within = Row::Zero(), right_around = Row::Zero();
  };

  // The surroundings may have slipped along the bone together, as one: a motion of its own, of known spread,
  // that takes from them what they say about the bone's.
  struct Softening {
    Eigen::Matrix<double, 8, 6> by_slip;  // what is taken per unit of a row's motion part
    Row Of(const Row& row) const { return row - by_slip * row.head<6>(); }
    Normal Of(const Normal& around) const { return around - by_slip * around.topRows<6>(); }
  };

  // Samples near each other: their part of the equations.
  struct Cluster {
    Normal normal = Normal::Zero();
    Row right = Row::Zero();
  };
  std::map<std::array<int, 3>, Cluster> Clusters(const Softening& soft) const {
    std::map<std::array<int, 3>, Cluster> clusters;
    const double size_mm = std::max(kClusterMm, 2 * tissue_.voxel_mm);
    for (size_t i = 0; i < rest_.size(); ++i) {
      if (!seen_[i]) continue;
      const Eigen::Vector3d cell = (tissue_.samples[i].from_centre_mm / size_mm).array().floor();
      Cluster& cluster = clusters[{int(cell.x()), int(cell.y()), int(cell.z())}];
      const Row row = RowOf(i), shown = IsAround(i) ? soft.Of(row) : row;
      cluster.normal += trust_[i] * shown * row.transpose();
      cluster.right += trust_[i] * residual_[i] * shown;
    }
    return clusters;
  }

  double ResidualVariance() const {
    double squares = 0, count = 0;
    for (size_t i = 0; i < rest_.size(); ++i) {
      if (seen_[i]) squares += trust_[i] * residual_[i] * residual_[i], count += trust_[i];
    }
    return squares / std::max(1e-9, count);
  }

  bool IsAround(size_t i) const { return tissue_.samples[i].away_mm > 0; }

  Softening SofteningOf(const Normal& around) const {
    Eigen::Matrix<double, 6, 6> held = Eigen::Matrix<double, 6, 6>::Zero();
    const double certainty = noise_ * noise_ / (kCommonSlipMm * kCommonSlipMm);
    held.topLeftCorner<3, 3>() = certainty * tissue_.lever_mm2;  // a turn moves the surface by its lever
    held.bottomRightCorner<3, 3>().diagonal().setConstant(certainty);
    const Eigen::Matrix<double, 6, 6> both = around.topLeftCorner<6, 6>() + held;
    return {both.ldlt().solve(around.topRows<6>()).transpose()};
  }

  Halves Sums() const {
    Halves halves;
    for (size_t i = 0; i < rest_.size(); ++i) {
      if (!seen_[i]) continue;
      const Row row = RowOf(i);
      (IsAround(i) ? halves.around : halves.within)
          .selfadjointView<Eigen::Lower>()
          .rankUpdate(row, trust_[i]);
      (IsAround(i) ? halves.right_around : halves.right_within) += row * (trust_[i] * residual_[i]);
    }
    halves.within = halves.within.selfadjointView<Eigen::Lower>();
    halves.around = halves.around.selfadjointView<Eigen::Lower>();
    return halves;
  }

  // The normal matrices without what noise adds to them: the noises of template and scan have nothing to do
  // with each other, so products of one's gradient with the other's hold signal only. In directions that show
  // little of it, a small part of the whole is left.
  Halves Signal() const {
    Halves out, whole = Sums();
    for (size_t i = 0; i < rest_.size(); ++i) {
      if (!seen_[i]) continue;
      const Row a = RowWith(i, gain_ * gradient_[i]), b = RowWith(i, tissue_.samples[i].gradient);
      (IsAround(i) ? out.around : out.within) += trust_[i] * (0.5 * (a * b.transpose() + b * a.transpose()));
    }
    out.within = PartOf(whole.within, out.within);
    out.around = PartOf(whole.around, out.around);
    return out;
  }

  static Normal PartOf(Normal whole, const Normal& signal) {
    whole.diagonal().array() += 1e-9;
    const Eigen::LLT<Normal> root(whole);
    Normal relative = root.matrixL().solve(signal);
    relative = root.matrixL().solve(relative.transpose().eval());
    const Eigen::SelfAdjointEigenSolver<Normal> parts(relative);
    constexpr double kLeastPart = 0.02;
    const Row part = parts.eigenvalues().cwiseMax(kLeastPart).cwiseMin(1.0);
    const Normal back = Normal(root.matrixL()) * parts.eigenvectors();
    return back * part.asDiagonal() * back.transpose();
  }

  // Derivative of the residual's model by the motion: the mean of both images' gradients, which halves what
  // noise adds to either.
  Row RowOf(size_t i) const { return RowWith(i, 0.5 * (gain_ * gradient_[i] + tissue_.samples[i].gradient)); }

  Row RowWith(size_t i, const Eigen::Vector3d& gradient) const {
    const TissueSample& sample = tissue_.samples[i];
    const Eigen::Vector3d g = sample.own_weight * gradient;
    Row row;
    row << sample.from_centre_mm.cross(g), g, value_[i], 1.0;
    return row;
  }

  double NoiseSd() const {
    std::vector<double> sizes;
    for (size_t i = 0; i < rest_.size(); ++i) {
      if (seen_[i]) sizes.push_back(std::abs(residual_[i]));
    }
    if (sizes.empty()) return 1e-6;
    std::nth_element(sizes.begin(), sizes.begin() + sizes.size() / 2, sizes.end());
    return 1.4826 * sizes[sizes.size() / 2] + 1e-6;
  }

  const BoneTissue& tissue_;
  const CubicImage& scan_;
  std::vector<double> trust_, value_, residual_;
  std::vector<Eigen::Vector3d> rest_, gradient_;
  std::vector<uint8_t> seen_;
  double gain_ = 1, bias_ = 0, noise_ = 1;
};

// T x -> T (centre + R (x - centre) + shift).
RigidTransform Moved(const RigidTransform& pose, const PointMm& centre, const Row& step) {
  RigidTransform turn = RotationAbout(centre, step.head<3>(), step.head<3>().norm());
  turn.translation_mm += step.segment<3>(3);
  return pose * turn;
}

double Length(const Row& step, double radius_mm) {
  return std::max(step.segment<3>(3).norm(), step.head<3>().norm() * radius_mm);
}

BoneEstimate FitOne(const BoneTissue& tissue, const CubicImage& scan, const PoseVector& poses, int bone,
                    bool last) {
  BoneProblem problem(tissue, scan, poses);
  RigidTransform pose = poses[bone];
  problem.Look(pose);
  for (int n = 0; n < kSteps; ++n) {
    problem.Trust();
    problem.Look(pose);
    Row right;
    const Normal normal = problem.Equations(right);
    Row step = normal.ldlt().solve(right);
    const double length = Length(step, tissue.radius_mm), limit_mm = 0.5 * tissue.voxel_mm;
    if (!std::isfinite(length)) break;
    if (length > limit_mm) step *= limit_mm / length;
    pose = Moved(pose, tissue.centre, step);
    problem.Look(pose);
    if (length < 1e-3 * tissue.voxel_mm) break;
  }
  BoneEstimate out{pose, Twist6Covariance::Zero(), 0};
  if (last) out.covariance = problem.Covariance(), out.correlation = problem.Correlation();
  return out;
}

double MovedMm(const BoneTissue& tissue, const RigidTransform& a, const RigidTransform& b) {
  const RigidTransform between = a.Inverse() * b;
  return std::max(between.AngleRad() * tissue.radius_mm,
                  ((between * tissue.centre).lps - tissue.centre.lps).norm());
}

}  // namespace

std::vector<BoneTissue> SampleTissue(const BoneSet& bones, const CubicImage& template_image,
                                     const WeightMap& weights) {
  std::vector<BoneTissue> tissue(bones.size());
  ParallelFor(bones.size(), [&](size_t b) { tissue[b] = TissueOf(bones, int(b), template_image, weights); });
  return tissue;
}

std::vector<BoneEstimate> FitArticulated(const std::vector<BoneTissue>& tissue, const CubicImage& scan,
                                         const PoseVector& start, const std::vector<double>& reach_mm) {
  PoseVector poses = start;
  std::vector<BoneEstimate> fits(tissue.size());
  for (int round = 0; round < kRounds; ++round) {
    ParallelFor(tissue.size(),
                [&](size_t b) { fits[b] = FitOne(tissue[b], scan, poses, int(b), round + 1 == kRounds); });
    for (size_t b = 0; b < tissue.size(); ++b) {
      if (MovedMm(tissue[b], start[b], fits[b].scan_from_template) > reach_mm[b]) {
        fits[b].scan_from_template = start[b];
      }
      poses[b] = fits[b].scan_from_template;
    }
  }
  return fits;
}

}  // namespace kvx
