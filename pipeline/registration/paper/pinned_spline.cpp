// G w = d with d = 0 at the fixed points.
#include "pipeline/registration/paper/pinned_spline.h"

#include <algorithm>

namespace kvx {
namespace {

bool FarFromAll(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& nodes) {
  return std::ranges::all_of(
      nodes, [&](const Eigen::Vector3d& node) { return (node - p).norm() >= PinnedSpline::kLeastGap; });
}

}  // namespace

PinnedSpline::PinnedSpline(const std::array<bool, kControlPoints>& in_bone,
                           const std::vector<Eigen::Vector3d>& fixed) {
  const BlockSpline corners;
  for (int a = 0; a < kControlPoints; ++a) {
    if (!in_bone[size_t(a)]) free_.push_back(a), nodes_.push_back(corners.control_points()[size_t(a)]);
  }
  for (int a = 0; a < kControlPoints; ++a) {
    if (in_bone[size_t(a)]) nodes_.push_back(corners.control_points()[size_t(a)]);
  }
  int used = 0;
  for (const Eigen::Vector3d& p : fixed) {
    if (used == kMostFixed) break;
    if (p.norm() < 1 - kLeastGap && FarFromAll(p, nodes_)) nodes_.push_back(p), ++used;
  }
  const Eigen::Index n = Eigen::Index(nodes_.size());
  Eigen::MatrixXd green(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      green(a, b) = ClampedPlateGreen(nodes_[size_t(a)], nodes_[size_t(b)]);
    }
  }
  weights_.resize(n, Eigen::Index(free_.size()));
  if (!free_.empty()) weights_ = green.ldlt().solve(Eigen::MatrixXd::Identity(n, weights_.cols()));
}

Eigen::RowVectorXd PinnedSpline::Basis(const Eigen::Vector3d& p) const {
  Eigen::RowVectorXd green(Eigen::Index(nodes_.size()));
  for (Eigen::Index a = 0; a < green.size(); ++a) green[a] = ClampedPlateGreen(p, nodes_[size_t(a)]);
  return green * weights_;
}

}  // namespace kvx
