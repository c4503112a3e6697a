// Bins as one sorted list; a tetrahedron is in every bin that its box touches. Inverted ones are in none.
#include "pipeline/phantom/motion/tet_locator.h"

namespace kvx::phantom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

Box BoxOf(const TetMesh& mesh, const std::vector<Vector3d>& nodes, size_t tet) {
  Box box;
  for (const int n : mesh.tets[tet]) box.Add(nodes[size_t(n)], Vector3d::Zero());
  return box;
}

}  // namespace

TetLocator::TetLocator(const TetMesh& mesh, const std::vector<Vector3d>& posed_nodes)
    : mesh_(mesh), bin_mm_(mesh.cell_mm), inverses_(mesh.tets.size()) {
  for (const Vector3d& node : posed_nodes) box_.Add(node, Vector3d::Constant(1e-3));
  bins_ = ((box_.high - box_.low) / bin_mm_).array().ceil().cast<int>() + 1;
  FillBins(posed_nodes);
}

void TetLocator::FillBins(const std::vector<Vector3d>& posed_nodes) {
  const auto for_bins = [&](size_t tet, const auto& visit) {
    const Box box = BoxOf(mesh_, posed_nodes, tet);
    const Vector3i low = ((box.low - box_.low) / bin_mm_).array().floor().cast<int>();
    const Vector3i high = ((box.high - box_.low) / bin_mm_).array().floor().cast<int>();
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i) visit((size_t(k) * bins_.y() + j) * bins_.x() + i);
      }
    }
  };
  std::vector<uint8_t> upright(mesh_.tets.size(), 0);
  first_.assign(size_t(bins_.prod()) + 1, 0);
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    const std::array<int, 4>& n = mesh_.tets[t];
    Matrix3d edges, by_axis;
    for (int s = 0; s < 3; ++s) {
      edges.col(s) = posed_nodes[size_t(n[s + 1])] - posed_nodes[size_t(n[s])];
      by_axis.col(kWalks[mesh_.walks[t]][s]) = edges.col(s);
    }
    upright[t] = by_axis.determinant() > 1e-6 * std::pow(mesh_.cell_mm, 3);
    if (!upright[t]) continue;
    inverses_[t] = {edges.inverse(), posed_nodes[size_t(n[0])]};
    for_bins(t, [&](size_t bin) { ++first_[bin + 1]; });
  }
  for (size_t bin = 1; bin < first_.size(); ++bin) first_[bin] += first_[bin - 1];
  members_.resize(first_.back());
  std::vector<size_t> next(first_.begin(), first_.end() - 1);
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    if (upright[t]) for_bins(t, [&](size_t bin) { members_[next[bin]++] = int(t); });
  }
}

Vector3d TetLocator::RestAt(int tet, const Vector3d& along) const {
  Vector3d rest = mesh_.nodes[size_t(mesh_.tets[size_t(tet)][0])];
  for (int s = 0; s < 3; ++s) rest[kWalks[mesh_.walks[size_t(tet)]][s]] += mesh_.cell_mm * along[s];
  return rest;
}

}  // namespace kvx::phantom
