// Robust least squares for a turn, a shift, a symmetric stretch, gain and bias.
#include "pipeline/bones/judge/bone_stretch.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/bones/refine/trust.h"
#include "pipeline/scans/alike_images.h"

namespace kvx {
namespace {

constexpr int kStretch = 6, kGain = 12, kBias = 13, kUnknowns = 14;  // after turn and shift
using Row = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Elements = Eigen::Matrix<double, 6, 1>;  // of a symmetric matrix: xx, yy, zz, xy, yz, zx

constexpr int kSteps = 12;
constexpr double kSeenPart = 0.5;   // of the bone
constexpr double kMostlyOwn = 0.5;  // skinning weight of tissue that goes with the bone

// a . (m b), by the elements of a symmetric m.
Elements Between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Elements out;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    out[i] = a[i] * b[i];
    out[3 + i] = a[i] * b[j] + a[j] * b[i];
  }
  return out;
}

Eigen::Matrix3d Symmetric(const Elements& elements) {
  Eigen::Matrix3d out;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    out(i, i) = elements[i];
    out(i, j) = out(j, i) = elements[3 + i];
  }
  return out;
}

// Of the template, as blurred as the scan.
struct Sample {
  Eigen::Vector3d from_centre_mm;
  double value;
  Eigen::Vector3d gradient;  // per mm
};

struct Pair {
  const Sample* sample;
  Row row;  // derivative of what the scan shows, in the template's greys; then its grey, and 1
  double trust = 1;
};

class StretchFit {
 public:
  StretchFit(const BoneTissue& tissue, const CubicImage& template_image, const CubicImage& scan,
             const RigidTransform& pose)
      : tissue_(tissue),
        alike_(Liken(template_image.grid(), scan.grid(), pose)),
        scan_(scan, alike_.b_sd_mm),
        pose_(pose) {
    const BlurredImage seen(template_image, alike_.a_sd_mm);
    for (const TissueSample& sample : tissue.samples) {
      if (sample.away_mm <= tissue.voxel_mm && sample.own_weight >= kMostlyOwn)
        samples_.push_back(AsBlurred(sample, seen));
    }
  }

  std::optional<BoneStretch> Run() {
    for (int n = 0; n < kSteps; ++n) {
      Look();
      if (double(pairs_.size()) < kSeenPart * double(std::max<size_t>(1, samples_.size()))) return {};
      const double moved_mm = Step();
      if (!std::isfinite(moved_mm)) return {};
      if (moved_mm < 1e-3 * tissue_.voxel_mm) break;
    }
    return BoneStretch{stretch_, Covariance().block<6, 6>(kStretch, kStretch)};
  }

 private:
  Sample AsBlurred(const TissueSample& sample, const BlurredImage& seen) const {
    Sample out{sample.from_centre_mm, sample.value, sample.gradient};
    Eigen::Vector3d per_voxel;
    const PointMm at{tissue_.centre.lps + sample.from_centre_mm};
    if (seen.blurs() && seen.At(seen.grid().ToVox(at).ijk, out.value, per_voxel))
      out.gradient = seen.grid().VoxFromMm().transpose() * per_voxel;
    return out;
  }

  void Look() {
    pairs_.clear();
    const Eigen::Matrix3d vox_from_mm = scan_.grid().VoxFromMm();
    const Eigen::Matrix3d template_from_scan = pose_.rotation.toRotationMatrix().transpose();
    for (const Sample& sample : samples_) {
      const PointMm at = pose_ * PointMm{tissue_.centre.lps + stretch_ * sample.from_centre_mm};
      double in_scan;
      Eigen::Vector3d per_voxel;
      if (!scan_.At(scan_.grid().ToVox(at).ijk, in_scan, per_voxel)) continue;
      const Eigen::Vector3d scan_slope = template_from_scan * (vox_from_mm.transpose() * per_voxel);
      // The mean of both images' slopes halves what noise adds to either.
      const Eigen::Vector3d slope = 0.5 * (gain_ * scan_slope + sample.gradient);
      Pair pair{&sample, {}};
      pair.row << sample.from_centre_mm.cross(slope), slope, Between(slope, sample.from_centre_mm), in_scan,
          1;
      pairs_.push_back(pair);
    }
    if (fitted_) Trust();
  }

  double Residual(const Pair& pair) const { return pair.sample->value - gain_ * pair.row[kGain] - bias_; }

  void Trust() {
    std::vector<double> sizes;
    for (const Pair& pair : pairs_) sizes.push_back(std::abs(Residual(pair)));
    const double usual = UsualResidual(sizes);
    for (Pair& pair : pairs_) {
      const double odd = Residual(pair) / (kTolerance * usual);
      pair.trust = TrustAt(odd * odd);
    }
  }

  Normal WeighedNormal() const {
    Normal normal = 1e-9 * Normal::Identity();
    for (const Pair& pair : pairs_) normal.noalias() += pair.trust * pair.row * pair.row.transpose();
    return normal;
  }

  // How far it would move the bone, mm; it goes half a voxel at most.
  double Step() {
    Row right = Row::Zero();
    for (const Pair& pair : pairs_) right += pair.trust * pair.sample->value * pair.row;
    Row step = WeighedNormal().ldlt().solve(right);
    gain_ = std::max(1e-3, step[kGain]), bias_ = step[kBias], fitted_ = true;
    const double moved_mm = std::max({step.segment<3>(3).norm(), step.head<3>().norm() * tissue_.radius_mm,
                                      step.segment<6>(kStretch).norm() * tissue_.radius_mm});
    step *= std::min(1.0, 0.5 * tissue_.voxel_mm / std::max(1e-12, moved_mm));
    RigidTransform motion = RotationAbout(tissue_.centre, step.head<3>(), step.head<3>().norm());
    motion.translation_mm += step.segment<3>(3);
    pose_ = pose_ * motion;
    stretch_ += Symmetric(step.segment<6>(kStretch));
    return moved_mm;
  }

  // What the residuals' size says, and what their sums over clusters say (clustered sandwich).
  Normal Covariance() const {
    std::map<std::array<int, 3>, Row> clusters;
    double squares = 0, count = 0;
    for (const Pair& pair : pairs_) {
      const double residual = Residual(pair);
      const auto sum =
          clusters.try_emplace(ClusterOf(pair.sample->from_centre_mm, tissue_.voxel_mm), Row::Zero()).first;
      sum->second += pair.trust * residual * pair.row;
      squares += pair.trust * residual * residual, count += pair.trust;
    }
    Normal scatter = Normal::Zero();
    for (const auto& [cell, sum] : clusters) scatter += sum * sum.transpose();
    const Normal inverse = WeighedNormal().ldlt().solve(Normal::Identity());
    return squares / std::max(1e-9, count) * inverse + inverse * scatter * inverse;
  }

  const BoneTissue& tissue_;
  const Likening alike_;
  const BlurredImage scan_;
  std::vector<Sample> samples_;
  std::vector<Pair> pairs_;
  RigidTransform pose_;
  Eigen::Matrix3d stretch_ = Eigen::Matrix3d::Identity();
  double gain_ = 1, bias_ = 0;
  bool fitted_ = false;
};

}  // namespace

double SdAlong(const BoneStretch& stretch, const Eigen::Vector3d& axis) {
  const Elements along = Between(axis, axis);
  return std::sqrt(std::max(0.0, along.dot(stretch.covariance * along)));
}

std::optional<BoneStretch> StretchOf(const BoneTissue& tissue, const CubicImage& template_image,
                                     const CubicImage& scan, const RigidTransform& scan_from_template) {
  return StretchFit(tissue, template_image, scan, scan_from_template).Run();
}

}  // namespace kvx
