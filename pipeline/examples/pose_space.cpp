// Interpolation of scattered examples as the most likely function through them. What the examples say is
// thought of as a smooth part that grows from the template, joint by joint, and a part of its own of every
// scan (its noise), which reaches a few degrees: exact at each scan, an average of several between them.
#include "pipeline/examples/pose_space.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr double kOnTheHull = 1e-2;  // example distances that the search for the nearest hull point leaves
// Examples nearer than this look the same to a bone and share their coefficient
constexpr double kSamePoseRad = 1e-3;
constexpr double kScansOwnRad = 0.1;   // a scan's own part weighs as much as this much motion ...
constexpr double kOwnReachRad = 0.05;  // ... and is gone a few times this far from it
constexpr double kBeyondRange = 0.25;  // growth goes on for this part of the examples' range, then stops

void AddDofs(const Skeleton& skeleton, int joint, std::set<int>& dofs) {
  const int first = skeleton.FirstDof(joint);
  for (size_t d = 0; d < skeleton.joints[joint].dofs.size(); ++d) dofs.insert(first + int(d));
}

// Its own joint, its drivers and its children's joints.
std::set<int> NeighbouringDofs(const Skeleton& skeleton, int bone) {
  std::set<int> dofs;
  AddDofs(skeleton, bone, dofs);
  for (const int driver : skeleton.joints[bone].drivers) AddDofs(skeleton, driver, dofs);
  for (size_t j = 0; j < skeleton.joints.size(); ++j) {
    if (skeleton.joints[j].parent == bone) AddDofs(skeleton, int(j), dofs);
  }
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

Eigen::RowVectorXd Pick(const JointAngles& angles, const std::vector<int>& dofs) {
  Eigen::RowVectorXd out(dofs.size());
  for (size_t d = 0; d < dofs.size(); ++d) out[d] = angles[dofs[d]];
  return out;
}

// Positions in `dofs` that belong to one joint each.
std::vector<std::vector<int>> JointsAmong(const Skeleton& skeleton, const std::vector<int>& dofs) {
  std::vector<std::vector<int>> out;
  for (size_t joint = 0; joint < skeleton.joints.size(); ++joint) {
    const int first = skeleton.FirstDof(int(joint)), count = int(skeleton.joints[joint].dofs.size());
    std::vector<int> here;
    for (size_t d = 0; d < dofs.size(); ++d) {
      if (dofs[d] >= first && dofs[d] < first + count) here.push_back(int(d));
    }
    if (!here.empty()) out.push_back(here);
  }
  return out;
}

// Distinct local poses (the template's first) and what each must give: its scans in equal shares, the
// template nothing.
struct Examples {
  Eigen::MatrixXd centres, wanted;
};

Examples DistinctExamples(const std::vector<JointAngles>& scans, const std::vector<int>& dofs) {
  std::vector<Eigen::RowVectorXd> centres{Eigen::RowVectorXd::Zero(dofs.size())};
  std::vector<std::vector<int>> members{{}};
  for (size_t k = 0; k < scans.size(); ++k) {
    const Eigen::RowVectorXd at = Pick(scans[k], dofs);
    const auto same = std::find_if(centres.begin(), centres.end(),
                                   [&](const auto& c) { return (c - at).norm() < kSamePoseRad; });
    if (same == centres.end()) {
      centres.push_back(at);
      members.push_back({int(k)});
    } else {
      members[same - centres.begin()].push_back(int(k));
    }
  }
  Examples out{Eigen::MatrixXd(centres.size(), dofs.size()),
               Eigen::MatrixXd::Zero(centres.size(), scans.size())};
  for (size_t e = 0; e < centres.size(); ++e) {
    out.centres.row(e) = centres[e];
    for (const int k : members[e]) out.wanted(e, k) = e == 0 ? 0.0 : 1.0 / double(members[e].size());
  }
  return out;
}

// Covariance of the displacements at two poses; 0 where either is the template's. Per joint a linear growth
// and a Brownian motion: a joint's effect does not depend on the others, unless the examples say so.
double Covariance(const Eigen::RowVectorXd& a, const Eigen::RowVectorXd& b,
                  const std::vector<std::vector<int>>& joints) {
  double sum = 0;
  for (const std::vector<int>& dofs : joints) {
    const Eigen::RowVectorXd at = a(dofs), bt = b(dofs);
    sum += at.dot(bt) + 0.5 * (at.norm() + bt.norm() - (at - bt).norm());
  }
  const auto near = [](double distance) { return std::exp(-distance / kOwnReachRad); };
  return sum + kScansOwnRad * (near((a - b).norm()) - near(a.norm()) * near(b.norm()));
}

Eigen::VectorXd Covariances(const Eigen::MatrixXd& centres, const Eigen::RowVectorXd& at,
                            const std::vector<std::vector<int>>& joints) {
  Eigen::VectorXd out(centres.rows());
  for (Eigen::Index e = 0; e < out.size(); ++e) out[e] = Covariance(centres.row(e), at, joints);
  return out;
}

// Mean distance between two examples; one radian when the template stands alone.
double TypicalDistance(const Eigen::MatrixXd& centres) {
  double sum = 0;
  int pairs = 0;
  for (Eigen::Index a = 0; a < centres.rows(); ++a) {
    for (Eigen::Index b = 0; b < a; ++b, ++pairs) sum += (centres.row(a) - centres.row(b)).norm();
  }
  return pairs ? sum / pairs : 1.0;
}

// Distance from a point to the convex hull of the rows, by Frank-Wolfe steps towards or away from single
// rows.
double DistanceToHull(const Eigen::MatrixXd& centres, const Eigen::RowVectorXd& at) {
  Eigen::VectorXd share = Eigen::VectorXd::Zero(centres.rows());
  share[0] = 1;
  Eigen::RowVectorXd place = centres.row(0);
  for (int step = 0; step < 2000; ++step) {
    const Eigen::VectorXd slope = centres * (place - at).transpose();
    Eigen::Index to = 0, from = -1;
    slope.minCoeff(&to);
    for (Eigen::Index e = 0; e < share.size(); ++e) {
      if (share[e] > 0 && (from < 0 || slope[e] > slope[from])) from = e;
    }
    const Eigen::RowVectorXd direction = centres.row(to) - centres.row(from);
    const double gain = slope[from] - slope[to];
    if (gain < 1e-10) break;
    const double move = std::min(share[from], gain / direction.squaredNorm());
    share[to] += move;
    share[from] = move == share[from] ? 0.0 : share[from] - move;
    place = (centres.transpose() * share).transpose();
  }
  return (place - at).norm();
}

// Each angle held to the examples' range, a little wider.
Eigen::RowVectorXd WithinReach(const Eigen::MatrixXd& centres, Eigen::RowVectorXd at) {
  for (Eigen::Index d = 0; d < at.size(); ++d) {
    const double least = centres.col(d).minCoeff(), most = centres.col(d).maxCoeff();
    const double further = kBeyondRange * (most - least);
    at[d] = std::clamp(at[d], least - further, most + further);
  }
  return at;
}

Eigen::VectorXd Shares(const Eigen::MatrixXd& centres, double width, const Eigen::RowVectorXd& at) {
  const Eigen::VectorXd distance = (centres.rowwise() - at).rowwise().norm();
  // Cannot all vanish
  const Eigen::VectorXd bump = (-(distance.array() - distance.minCoeff()) / width).exp();
  return bump / bump.sum();
}

}  // namespace

PoseBasis PoseBasisFromName(const std::string& name) {
  if (name == "rbf") return PoseBasis::kRbf;
  if (name == "normalised") return PoseBasis::kNormalised;
  throw InputError("the basis of pose space is rbf or normalised");
}

PoseSpace::PoseSpace(const SkeletonFit& fit, const PoseSpaceOptions& options)
    : basis_(options.basis), scans_(int(fit.scan_angles.size())) {
  for (size_t bone = 0; bone < fit.skeleton.joints.size(); ++bone) {
    BoneSpace space;
    space.dofs = options.global ? AllDofs(fit.skeleton) : DofsOf(fit.skeleton, int(bone));
    space.joints = JointsAmong(fit.skeleton, space.dofs);
    const Examples examples = DistinctExamples(fit.scan_angles, space.dofs);
    space.centres = examples.centres;
    space.radius = TypicalDistance(space.centres);
    const Eigen::Index n = space.centres.rows();
    Eigen::MatrixXd system(n, n);
    for (Eigen::Index e = 0; e < n; ++e) system.row(e) = BasisAt(space, space.centres.row(e)).transpose();
    // The template's row and column are 0 for covariances: it takes no part.
    space.solution = system.completeOrthogonalDecomposition().solve(examples.wanted);
    for (Eigen::Index e = 0; e < n; ++e)
      system.row(e) = Covariances(space.centres, space.centres.row(e), space.joints).transpose();
    space.precision = system.completeOrthogonalDecomposition().pseudoInverse();
    spaces_.push_back(std::move(space));
  }
}

Eigen::VectorXd PoseSpace::BasisAt(const BoneSpace& space, const Eigen::RowVectorXd& at) const {
  if (basis_ == PoseBasis::kNormalised) return Shares(space.centres, space.radius, at);
  return Covariances(space.centres, at, space.joints);
}

Eigen::MatrixXd PoseSpace::Coefficients(const JointAngles& angles) const {
  Eigen::MatrixXd out(spaces_.size(), scans_);
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const BoneSpace& space = spaces_[bone];
    const Eigen::RowVectorXd at = WithinReach(space.centres, Pick(angles, space.dofs));
    out.row(bone) = BasisAt(space, at).transpose() * space.solution;
  }
  return out;
}

Eigen::VectorXd PoseSpace::Uncertainty(const JointAngles& angles) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(Eigen::Index(spaces_.size()));
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const BoneSpace& space = spaces_[bone];
    const Eigen::RowVectorXd at = Pick(angles, space.dofs);
    const double before = Covariance(at, at, space.joints);
    const Eigen::VectorXd with = Covariances(space.centres, at, space.joints);
    if (before > 0)
      out[Eigen::Index(bone)] =
          std::sqrt(std::clamp(1 - with.dot(space.precision * with) / before, 0.0, 1.0));
  }
  return out;
}

Eigen::VectorXd PoseSpace::Extrapolation(const JointAngles& angles) const {
  Eigen::VectorXd out(spaces_.size());
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const BoneSpace& space = spaces_[bone];
    const double beyond = DistanceToHull(space.centres, Pick(angles, space.dofs)) / space.radius;
    out[bone] = beyond < kOnTheHull ? 0.0 : beyond;
  }
  return out;
}

}  // namespace kvx
