// Distance basis functions: phi(r) = -r with a constant. In one dimension that is piecewise linear
// interpolation, constant beyond the outermost examples; in several it stays bounded everywhere, has no shape
// parameter and no ripples.
#include "pipeline/examples/pose_space.h"

#include <algorithm>
#include <set>

namespace kvx {
namespace {

constexpr double kOnTheHull = 1e-2;  // example distances that the search for the nearest hull point leaves
constexpr double kSamePoseRad =
    1e-3;  // examples nearer than this look the same to a bone and share their coefficient

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

// A bone amid rigid ones looks where its parent looks; without any such ancestor, at everything.
std::vector<int> DofsOf(const Skeleton& skeleton, int bone) {
  std::set<int> dofs;
  for (int b = bone; b != kNoParent && dofs.empty(); b = skeleton.joints[b].parent)
    dofs = NeighbouringDofs(skeleton, b);
  std::vector<int> out(dofs.begin(), dofs.end());
  for (int d = 0; dofs.empty() && d < skeleton.DofCount(); ++d) out.push_back(d);
  return out;
}

Eigen::RowVectorXd Pick(const JointAngles& angles, const std::vector<int>& dofs) {
  Eigen::RowVectorXd out(dofs.size());
  for (size_t d = 0; d < dofs.size(); ++d) out[d] = angles[dofs[d]];
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

Eigen::VectorXd Basis(const Eigen::MatrixXd& centres, const Eigen::RowVectorXd& at) {
  Eigen::VectorXd out(centres.rows() + 1);
  out.head(centres.rows()) = -(centres.rowwise() - at).rowwise().norm();
  out[centres.rows()] = 1;
  return out;
}

// -r is conditionally positive definite of order 1: with the constant and weights that sum to 0 the system is
// regular.
Eigen::MatrixXd Solve(const Examples& examples) {
  const Eigen::Index n = examples.centres.rows();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1, n + 1),
                  right = Eigen::MatrixXd::Zero(n + 1, examples.wanted.cols());
  for (Eigen::Index e = 0; e < n; ++e)
    system.row(e) = Basis(examples.centres, examples.centres.row(e)).transpose();
  system.row(n).head(n).setOnes();
  right.topRows(n) = examples.wanted;
  return system.fullPivLu().solve(right);
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

}  // namespace

PoseSpace::PoseSpace(const SkeletonFit& fit) : scans_(int(fit.scan_angles.size())) {
  for (size_t bone = 0; bone < fit.skeleton.joints.size(); ++bone) {
    BoneSpace space;
    space.dofs = DofsOf(fit.skeleton, int(bone));
    const Examples examples = DistinctExamples(fit.scan_angles, space.dofs);
    space.centres = examples.centres;
    space.solution = Solve(examples);
    space.radius = TypicalDistance(space.centres);
    spaces_.push_back(std::move(space));
  }
}

Eigen::MatrixXd PoseSpace::Coefficients(const JointAngles& angles) const {
  Eigen::MatrixXd out(spaces_.size(), scans_);
  for (size_t bone = 0; bone < spaces_.size(); ++bone) {
    const BoneSpace& space = spaces_[bone];
    out.row(bone) = Basis(space.centres, Pick(angles, space.dofs)).transpose() * space.solution;
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
