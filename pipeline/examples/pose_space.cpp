// Interpolation of scattered examples as the most likely function through them. What the examples say is
// thought of as a smooth part that grows from the template, each joint by its own measure near each bone, and
// a part of its own of every scan (its noise), which reaches a few degrees: exact at each scan, an average of
// several between them.
#include "pipeline/examples/pose_space.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "core/errors.h"
#include "pipeline/examples/scattered_poses.h"

namespace kvx {
namespace {

constexpr double kOnTheHull = 1e-2;    // example distances that the search for the nearest hull point leaves
constexpr double kOwnReachRad = 0.05;  // a scan's own part is gone a few times this far from it
constexpr double kMostRoundRad = 0.025;  // farther hardly makes it rounder, and nearly alike scans worse
constexpr double kRoundPart = 0.125;     // of the distance of the two nearest poses: none gets 1.1 or -0.1
constexpr double kBeyondRange = 0.25;    // growth goes on for this part of the examples' range, then stops
constexpr double kEqualRows = 1e-12;     // of covariances: rounding; distinct poses differ by far more

void AddDofs(const Skeleton& skeleton, int joint, std::set<int>& dofs) {
  const int first = skeleton.FirstDof(joint);
  for (size_t d = 0; d < skeleton.joints[joint].dofs.size(); ++d) dofs.insert(first + int(d));
}

std::set<int> NeighbouringDofs(const Skeleton& skeleton, int bone) {
  std::set<int> dofs;
  for (const int joint : NeighbouringJoints(skeleton, bone)) AddDofs(skeleton, joint, dofs);
  return dofs;
}

std::vector<int> AllDofs(const Skeleton& skeleton) {
  std::vector<int> out(size_t(skeleton.DofCount()));
  std::iota(out.begin(), out.end(), 0);
  return out;
}

// A bone amid rigid ones looks where its parent looks; without any such ancestor, at everything.
std::vector<int> DofsOf(const Skeleton& skeleton, int bone) {
  std::set<int> dofs;
  for (int b = bone; b != kNoParent && dofs.empty(); b = skeleton.joints[b].parent)
    dofs = NeighbouringDofs(skeleton, b);
  return dofs.empty() ? AllDofs(skeleton) : std::vector<int>(dofs.begin(), dofs.end());
}

// Of every joint that turns, in order: whether its angles are among `dofs`.
std::vector<bool> JointsNear(const Skeleton& skeleton, const std::vector<int>& dofs) {
  std::vector<bool> near;
  for (size_t joint = 0; joint < skeleton.joints.size(); ++joint) {
    if (skeleton.joints[joint].dofs.empty()) continue;
    near.push_back(std::find(dofs.begin(), dofs.end(), skeleton.FirstDof(int(joint))) != dofs.end());
  }
  return near;
}

// An exponential without its corner at 0, where every motion would change its speed as it passes a scan; a
// covariance in any number of angles. Scans within the part that is round would tell of a slope, by which
// noise grows beyond them.
double Near(double distance_rad, double round_rad) {
  return (kOwnReachRad * std::exp(-distance_rad / kOwnReachRad) -
          round_rad * std::exp(-distance_rad / round_rad)) /
         (kOwnReachRad - round_rad);
}

// For scans at distinct poses, the template's among them, and repeats of these.
double RoundRad(const PoseRows& scans) {
  double round_rad = kMostRoundRad;
  const auto limit = [&](double distance_rad) {
    if (distance_rad > 0) round_rad = std::min(round_rad, kRoundPart * distance_rad);
  };
  for (Eigen::Index k = 0; k < scans.rows(); ++k) {
    limit(scans.row(k).norm());
    for (Eigen::Index l = 0; l < k; ++l) limit((scans.row(k) - scans.row(l)).norm());
  }
  return round_rad;
}

// What the scans' own parts have in common at pairs of poses, before their sizes; 0 at the template.
Eigen::MatrixXd OwnParts(const PoseRows& a, const PoseRows& b, double round_rad) {
  const auto near = [&](const Eigen::RowVectorXd& way) { return Near(way.norm(), round_rad); };
  Eigen::MatrixXd out(a.rows(), b.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < b.rows(); ++j)
      out(i, j) = near(a.row(i) - b.row(j)) - near(a.row(i)) * near(b.row(j));
  }
  return out;
}

// Scans of one pose stand at one place, that of the least angles; those of the template's pose at the
// template.
PoseRows AtDistinctPoses(const PoseRows& scans, const std::vector<int>& dofs) {
  const DistinctPoses examples = FindDistinctPoses(scans, dofs);
  return (examples.wanted.array() > 0).cast<double>().matrix().transpose() * examples.centres;
}

// Of scans near poses, by which the own part there is as large as theirs. Beside each other it is of one
// size: were it not, coefficients would make up for that, and turn one scan against the other.
Eigen::MatrixXd SizesFrom(const PoseRows& scans, const PoseRows& at) {
  Eigen::MatrixXd out(at.rows(), scans.rows());
  for (Eigen::Index i = 0; i < at.rows(); ++i)
    out.row(i) = SharesByDistance(scans, kOwnReachRad, at.row(i)).transpose();
  return out;
}

// Scans of one pose have equal rows: they share what they give.
Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> Decomposed(const Eigen::MatrixXd& covariances) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> out;
  out.setThreshold(kEqualRows);
  return out.compute(covariances);
}

PoseRows RowsOf(const std::vector<JointAngles>& poses, int dofs) {
  PoseRows rows(Eigen::Index(poses.size()), dofs);
  for (size_t k = 0; k < poses.size(); ++k) rows.row(Eigen::Index(k)) = poses[k].transpose();
  return rows;
}

// A scan that shows nothing of a joint's bone stands at angles that mean nothing: the template's are within
// any range. Where no scan shows the bone, its angles are all that there is.
PoseRows ShownAngles(const Skeleton& skeleton, const ExampleMoments& moments, PoseRows scans) {
  for (size_t joint = 0; joint < skeleton.joints.size() && moments.hidden.size() > 0; ++joint) {
    if (moments.hidden.row(Eigen::Index(joint)).all()) continue;
    const auto dofs = Eigen::Index(skeleton.joints[joint].dofs.size());
    for (Eigen::Index k = 0; k < scans.rows(); ++k) {
      if (moments.hidden(Eigen::Index(joint), k))
        scans.row(k).segment(skeleton.FirstDof(int(joint)), dofs).setZero();
    }
  }
  return scans;
}

// Each angle held to the examples' range (the template among them), a little wider.
Eigen::RowVectorXd WithinReach(const PoseRows& scans, Eigen::RowVectorXd at) {
  for (Eigen::Index d = 0; d < at.size() && scans.rows() > 0; ++d) {
    const double least = std::min(0.0, scans.col(d).minCoeff()),
                 most = std::max(0.0, scans.col(d).maxCoeff());
    const double further = kBeyondRange * (most - least);
    at[d] = std::clamp(at[d], least - further, most + further);
  }
  return at;
}

// A space that looks at everything learns from the whole body.
Eigen::MatrixXd MomentsFor(const ExampleMoments& moments, size_t bone, bool global) {
  if (!global) return moments.of_bones[bone];
  Eigen::MatrixXd sum = moments.of_bones[0];
  for (size_t b = 1; b < moments.of_bones.size(); ++b) sum += moments.of_bones[b];
  return sum;
}

}  // namespace

PoseBasis PoseBasisFromName(const std::string& name) {
  if (name == "rbf") return PoseBasis::kRbf;
  if (name == "normalised") return PoseBasis::kNormalised;
  throw InputError("the basis of pose space is rbf or normalised");
}

PoseSpace::PoseSpace(const SkeletonFit& fit, const PoseSpaceOptions& options, const ExampleMoments& moments)
    : skeleton_(fit.skeleton), basis_(options.basis) {
  scans_ = RowsOf(fit.scan_angles, skeleton_.DofCount());
  range_ = ShownAngles(skeleton_, moments, scans_);
  // As poses that are asked for are: a scan's own angles are to find the scan, wherever they are
  for (Eigen::Index k = 0; k < scans_.rows(); ++k) scans_.row(k) = WithinReach(range_, scans_.row(k));
  scans_ = AtDistinctPoses(scans_, AllDofs(skeleton_));
  for (size_t bone = 0; bone < skeleton_.joints.size(); ++bone) {
    BoneSpace space;
    space.dofs = options.global ? AllDofs(skeleton_) : DofsOf(skeleton_, int(bone));
    spaces_.push_back(std::move(space));
  }
  const std::vector<Eigen::MatrixXd> shared = SharedMotion(skeleton_, scans_, scans_);
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    BoneSpace& space = spaces_[bone];
    space.variances = AssumedVariances(shared, JointsNear(skeleton_, space.dofs), scans_.rows());
    if (bone < moments.of_bones.size())
      space.variances = LearnVariances(shared, MomentsFor(moments, bone, options.global),
                                       moments.ShownNear(bone, int(scans_.rows())), space.variances);
  }
  Solve();
}

PoseSpace PoseSpace::With(const JointAngles& scan) const {
  PoseSpace out = *this;
  out.scans_.conservativeResize(scans_.rows() + 1, Eigen::NoChange);
  out.scans_.row(scans_.rows()) = scan.transpose();
  out.scans_ = AtDistinctPoses(out.scans_, AllDofs(skeleton_));
  out.range_.conservativeResize(scans_.rows() + 1, Eigen::NoChange);
  out.range_.row(scans_.rows()) = scan.transpose();
  for (BoneSpace& space : out.spaces_) {
    Eigen::VectorXd& share = space.variances.share;
    share.conservativeResize(share.size() + 1);
    share[share.size() - 1] = 1;
  }
  out.Solve();
  return out;
}

// For the scans there are, with the variances that are known.
void PoseSpace::Solve() {
  round_rad_ = RoundRad(scans_);
  std::vector<Eigen::MatrixXd> systems(spaces_.size(), Eigen::MatrixXd(scans_.rows(), scans_.rows()));
  for (Eigen::Index k = 0; k < scans_.rows(); ++k) {
    const Eigen::MatrixXd covariances = Covariances(scans_.row(k));
    for (size_t bone = 0; bone < spaces_.size(); ++bone)
      systems[bone].row(k) = covariances.row(Eigen::Index(bone));
  }
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    BoneSpace& space = spaces_[bone];
    const bool scanned = scans_.rows() > 0;  // Eigen does not solve for nothing
    space.covariances = std::move(systems[bone]);
    if (scanned) space.precision = Decomposed(space.covariances).pseudoInverse();
    const DistinctPoses examples = FindDistinctPoses(scans_, space.dofs);
    space.centres = examples.centres;
    space.radius = TypicalDistance(space.centres);
    Eigen::MatrixXd shares(space.centres.rows(), space.centres.rows());
    for (Eigen::Index e = 0; e < shares.rows(); ++e)
      shares.row(e) = SharesByDistance(space.centres, space.radius, space.centres.row(e)).transpose();
    space.of_shares = Eigen::MatrixXd(shares.rows(), 0);
    if (scanned) space.of_shares = shares.completeOrthogonalDecomposition().solve(examples.wanted);
  }
}

// Of the displacements at a pose with those of the scans, by bone; relative to the examples' mean square.
Eigen::MatrixXd PoseSpace::Covariances(const Eigen::RowVectorXd& at) const {
  Eigen::MatrixXd out(spaces_.size(), scans_.rows());
  const std::vector<Eigen::MatrixXd> shared = SharedMotion(skeleton_, at, scans_);
  const Eigen::RowVectorXd own = OwnParts(at, scans_, round_rad_);
  const Eigen::MatrixXd here = SizesFrom(scans_, at), there = SizesFrom(scans_, scans_);
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const Variances& v = spaces_[bone].variances;
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(scans_.rows());
    for (size_t t = 0; t < shared.size(); ++t) row += v.shared[Eigen::Index(t)] * shared[t];
    if (!shared.empty())
      row.array() +=
          v.own * own.array() * (here.row(0).dot(v.share) * (there * v.share).array()).sqrt().transpose();
    out.row(Eigen::Index(bone)) = row;
  }
  return out;
}

Eigen::MatrixXd PoseSpace::Coefficients(const JointAngles& angles) const {
  const Eigen::RowVectorXd at = WithinReach(range_, angles.transpose());
  Eigen::MatrixXd out(spaces_.size(), scans_.rows());
  if (scans_.rows() == 0) return out;
  if (basis_ == PoseBasis::kRbf) out = Covariances(at);
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const BoneSpace& space = spaces_[bone];
    if (basis_ == PoseBasis::kRbf)
      out.row(Eigen::Index(bone)) *= space.precision;
    else
      out.row(Eigen::Index(bone)) =
          SharesByDistance(space.centres, space.radius, at(space.dofs)).transpose() * space.of_shares;
  }
  return out;
}

Eigen::VectorXd PoseSpace::CoefficientsOfOthers(int bone, int scan, const Eigen::VectorXd& known) const {
  const Eigen::MatrixXd& all = spaces_.at(size_t(bone)).covariances;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(all.rows());
  std::vector<int> others;
  for (int k = 0; k < int(all.rows()); ++k) {
    if (k != scan && known[k] > 0) others.push_back(k);
  }
  if (others.empty()) return out;
  Eigen::MatrixXd among = all(others, others);
  const double typical = all.diagonal().mean();
  for (size_t n = 0; n < others.size(); ++n)
    among(Eigen::Index(n), Eigen::Index(n)) += typical * (1 / known[others[n]] - 1);
  const Eigen::VectorXd with_scan = all.col(scan)(others);
  const Eigen::VectorXd solved = Decomposed(among).solve(with_scan);
  out(others) = solved;
  return out;
}

Eigen::VectorXd PoseSpace::Uncertainty(const JointAngles& angles) const {
  Eigen::VectorXd out(Eigen::Index(spaces_.size()));
  const Eigen::RowVectorXd at = angles.transpose();
  const bool scanned = scans_.rows() > 0;
  const Eigen::MatrixXd with = scanned ? Covariances(at) : Eigen::MatrixXd();
  const std::vector<Eigen::MatrixXd> shared = SharedMotion(skeleton_, at, at);
  for (Eigen::Index bone = 0; bone < out.size(); ++bone) {
    const BoneSpace& space = spaces_[size_t(bone)];
    double variance = 0;
    for (size_t t = 0; t < shared.size(); ++t)
      variance += space.variances.shared[Eigen::Index(t)] * shared[t](0, 0);
    if (scanned) variance -= with.row(bone) * space.precision * with.row(bone).transpose();
    out[bone] = std::sqrt(std::max(0.0, variance));
  }
  return out;
}

Eigen::VectorXd PoseSpace::Extrapolation(const JointAngles& angles) const {
  Eigen::VectorXd out(spaces_.size());
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const BoneSpace& space = spaces_[bone];
    const double beyond = DistanceToHull(space.centres, angles(space.dofs).transpose()) / space.radius;
    out[bone] = beyond < kOnTheHull ? 0.0 : beyond;
  }
  return out;
}

}  // namespace kvx
