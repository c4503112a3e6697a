// Variance components by minorisation and maximisation (Zhou, Hu, Zhou, Lange 2019): every step has a closed
// form and makes the examples more likely.
#include "pipeline/examples/joint_relevance.h"

#include <cmath>

namespace kvx {
namespace {

constexpr double kFarJoint = 0.003;   // variance of a joint that is not near, relative to a near one
constexpr double kOwnShare = 0.03;    // of a scan's noise in the examples' variance, before they are seen
constexpr double kLeastShare = 0.1;   // noise where a scan shows no displacement, relative to a typical one
constexpr double kVoxels = 30;        // displacements near a bone that count as independent of each other
constexpr double kPriorVoxels = 0.3;  // what the assumed variances weigh against them
constexpr int kSteps = 100;

Eigen::MatrixXd Sum(const std::vector<Eigen::MatrixXd>& terms, const Eigen::VectorXd& factors) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(terms[0].rows(), terms[0].cols());
  for (size_t t = 0; t < terms.size(); ++t) sum += factors[Eigen::Index(t)] * terms[t];
  return sum;
}

// Most likely factors of `terms` in the covariance behind `moments`; inverse-gamma priors about `assumed`.
Eigen::VectorXd MostLikely(const std::vector<Eigen::MatrixXd>& terms, const Eigen::MatrixXd& moments,
                           const Eigen::VectorXd& assumed) {
  Eigen::VectorXd factors = assumed;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd inverse =
        Sum(terms, factors).llt().solve(Eigen::MatrixXd::Identity(moments.rows(), moments.cols()));
    const Eigen::MatrixXd pull = inverse * moments * inverse;
    for (size_t t = 0; t < terms.size(); ++t) {
      double& factor = factors[Eigen::Index(t)];
      const double a = kVoxels * terms[t].cwiseProduct(inverse).sum();
      const double b = kVoxels * terms[t].cwiseProduct(pull).sum() * factor * factor +
                       kPriorVoxels * assumed[Eigen::Index(t)];
      factor = 2 * b / (kPriorVoxels + std::sqrt(kPriorVoxels * kPriorVoxels + 4 * a * b));
    }
  }
  return factors;
}

}  // namespace

std::vector<int> NeighbouringJoints(const Skeleton& skeleton, int bone) {
  std::vector<int> joints{bone};
  const std::vector<int>& drivers = skeleton.joints[bone].drivers;
  joints.insert(joints.end(), drivers.begin(), drivers.end());
  for (size_t j = 0; j < skeleton.joints.size(); ++j) {
    if (skeleton.joints[j].parent == bone) joints.push_back(int(j));
  }
  return joints;
}

std::vector<Eigen::MatrixXd> SharedMotion(const Skeleton& skeleton, const PoseRows& poses_a,
                                          const PoseRows& poses_b) {
  std::vector<Eigen::MatrixXd> out;
  for (size_t joint = 0; joint < skeleton.joints.size(); ++joint) {
    const auto dofs = Eigen::Index(skeleton.joints[joint].dofs.size());
    if (dofs == 0) continue;
    const Eigen::MatrixXd a = poses_a.middleCols(skeleton.FirstDof(int(joint)), dofs),
                          b = poses_b.middleCols(skeleton.FirstDof(int(joint)), dofs);
    Eigen::MatrixXd wandering(a.rows(), b.rows());
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      for (Eigen::Index j = 0; j < b.rows(); ++j)
        wandering(i, j) = 0.5 * (a.row(i).norm() + b.row(j).norm() - (a.row(i) - b.row(j)).norm());
    }
    out.push_back(a * b.transpose());
    out.push_back(wandering);
  }
  return out;
}

Variances AssumedVariances(const std::vector<Eigen::MatrixXd>& shared, const std::vector<bool>& near,
                           Eigen::Index scans) {
  Variances out{Eigen::VectorXd(shared.size()), kOwnShare, Eigen::VectorXd::Ones(scans)};
  for (size_t t = 0; t < shared.size(); ++t) out.shared[Eigen::Index(t)] = near[t / 2] ? 1.0 : kFarJoint;
  if (shared.empty() || scans == 0) return out;
  const double mean = Sum(shared, out.shared).diagonal().mean();
  if (mean > 0) out.shared /= mean;
  return out;
}

Variances LearnVariances(const std::vector<Eigen::MatrixXd>& shared, const Eigen::MatrixXd& moments,
                         const std::vector<int>& scans, Variances assumed) {
  const Eigen::MatrixXd shown = moments(scans, scans);
  const double mean = scans.empty() ? 0.0 : shown.diagonal().mean();
  if (shared.empty() || !(mean > 0)) return assumed;
  const Eigen::VectorXd share = shown.diagonal().array() / mean + kLeastShare;
  std::vector<Eigen::MatrixXd> terms;
  for (const Eigen::MatrixXd& term : shared) terms.emplace_back(term(scans, scans));
  terms.emplace_back(share.asDiagonal());
  Eigen::VectorXd factors(terms.size());
  factors << assumed.shared, assumed.own;
  factors = MostLikely(terms, shown / mean, factors);
  for (size_t n = 0; n < scans.size(); ++n) assumed.share[scans[n]] = share[Eigen::Index(n)];
  assumed.shared = factors.head(factors.size() - 1);
  assumed.own = factors[factors.size() - 1];
  return assumed;
}

}  // namespace kvx
