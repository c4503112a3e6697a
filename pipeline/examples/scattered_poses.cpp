// Searches among a handful of poses; nothing here is worth an index.
#include "pipeline/examples/scattered_poses.h"

#include <algorithm>
#include <numeric>

namespace kvx {
namespace {

// Of every angle (0.1 mm of a shift): bones are hardly known better, so nearer poses are one
constexpr double kSamePoseRad = RadFromDeg(0.1);

// By their angles, so that which of several near poses are one does not depend on the order of the scans.
std::vector<Eigen::Index> InOrder(const PoseRows& poses) {
  std::vector<Eigen::Index> order(static_cast<size_t>(poses.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index(0));
  std::ranges::stable_sort(order, [&](Eigen::Index k, Eigen::Index l) {
    const Eigen::RowVectorXd a = poses.row(k), b = poses.row(l);
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return order;
}

}  // namespace

DistinctPoses FindDistinctPoses(const PoseRows& scans, const std::vector<int>& dofs) {
  std::vector<Eigen::RowVectorXd> centres{Eigen::RowVectorXd::Zero(dofs.size())};
  std::vector<std::vector<int>> members{{}};
  const PoseRows poses = scans(Eigen::all, dofs);
  for (const Eigen::Index k : InOrder(poses)) {
    const Eigen::RowVectorXd at = poses.row(k);
    const auto same = std::find_if(centres.begin(), centres.end(), [&](const Eigen::RowVectorXd& c) {
      return (c - at).lpNorm<Eigen::Infinity>() < kSamePoseRad;
    });
    if (same == centres.end()) {
      centres.push_back(at);
      members.push_back({int(k)});
    } else {
      members[same - centres.begin()].push_back(int(k));
    }
  }
  DistinctPoses out{Eigen::MatrixXd(centres.size(), dofs.size()),
                    Eigen::MatrixXd::Zero(centres.size(), scans.rows())};
  for (size_t e = 0; e < centres.size(); ++e) {
    out.centres.row(e) = centres[e];
    for (const int k : members[e]) out.wanted(e, k) = e == 0 ? 0.0 : 1.0 / double(members[e].size());
  }
  return out;
}

double TypicalDistance(const Eigen::MatrixXd& centres) {
  double sum = 0;
  int pairs = 0;
  for (Eigen::Index a = 0; a < centres.rows(); ++a) {
    for (Eigen::Index b = 0; b < a; ++b, ++pairs) sum += (centres.row(a) - centres.row(b)).norm();
  }
  return pairs ? sum / pairs : 1.0;
}

// By Frank-Wolfe steps towards or away from single rows.
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

Eigen::VectorXd SharesByDistance(const Eigen::MatrixXd& centres, double width, const Eigen::RowVectorXd& at) {
  const Eigen::VectorXd distance = (centres.rowwise() - at).rowwise().norm();
  // Cannot all vanish
  const Eigen::VectorXd bump = (-(distance.array() - distance.minCoeff()) / width).exp();
  return bump / bump.sum();
}

}  // namespace kvx
