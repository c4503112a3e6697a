// Moments in one pass over the voxels, extents along the long axis in a second.
#include "pipeline/segmentation/names/label_shapes.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <map>

#include "core/host/parallel.h"

namespace kvx {
namespace {

struct Moments {
  double count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
};

Eigen::Vector3d PlaceMm(const Grid& grid, size_t v) {
  return grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
}

template <class Visit>
void ForEachLabelled(const LabelMap& labels, Visit&& visit) {
  for (size_t v = 0; v < labels.values.size(); ++v) {
    if (labels.values[v] != 0) visit(labels.values[v], PlaceMm(labels.grid, v));
  }
}

// A label of few voxels has an extent of about a voxel, too.
Eigen::Matrix3d SpreadOf(const Moments& m, const Grid& grid) {
  const Eigen::Vector3d mean = m.sum / m.count;
  const double voxel_variance = std::pow(grid.MeanSpacingMm(), 2) / 12;
  return m.squares / m.count - mean * mean.transpose() + Eigen::Matrix3d::Identity() * voxel_variance;
}

}  // namespace

std::vector<LabelShape> LabelShapes(const LabelMap& labels) {
  std::map<int, Moments> moments;
  ForEachLabelled(labels, [&](int label, const Eigen::Vector3d& x) {
    Moments& m = moments[label];
    m.count += 1, m.sum += x, m.squares += x * x.transpose();
  });
  std::vector<LabelShape> shapes;
  std::map<int, Eigen::Vector3d> axis;
  std::map<int, std::pair<double, double>> reach;
  for (const auto& [label, m] : moments) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(SpreadOf(m, labels.grid));
    const Eigen::Vector3d variances = principal.eigenvalues();
    shapes.push_back(
        {label, size_t(m.count), PointMm{m.sum / m.count}, std::sqrt(variances[2] / variances[1]), {}});
    axis[label] = principal.eigenvectors().col(2);
    reach[label] = {0, 0};
  }
  ForEachLabelled(labels, [&](int label, const Eigen::Vector3d& x) {
    const double along = axis[label].dot(x - moments[label].sum / moments[label].count);
    auto& [low, high] = reach[label];
    low = std::min(low, along), high = std::max(high, along);
  });
  for (LabelShape& shape : shapes) {
    shape.ends[0] = {shape.centre.lps + reach[shape.label].first * axis[shape.label]};
    shape.ends[1] = {shape.centre.lps + reach[shape.label].second * axis[shape.label]};
  }
  return shapes;
}

std::vector<std::vector<double>> EndGapsMm(const LabelMap& labels, const std::vector<LabelShape>& shapes) {
  std::vector<int> shape_of(65536, -1);
  for (size_t s = 0; s < shapes.size(); ++s) shape_of[size_t(shapes[s].label)] = int(s);
  std::vector<std::pair<int, Eigen::Vector3d>> voxels;
  ForEachLabelled(
      labels, [&](int label, const Eigen::Vector3d& x) { voxels.emplace_back(shape_of[size_t(label)], x); });
  std::vector<std::vector<double>> gaps(
      2 * shapes.size(), std::vector<double>(shapes.size(), std::numeric_limits<double>::infinity()));
  ParallelFor(gaps.size(), [&](size_t end) {
    const Eigen::Vector3d at = shapes[end / 2].ends[end % 2].lps;
    for (const auto& [shape, x] : voxels)
      gaps[end][size_t(shape)] = std::min(gaps[end][size_t(shape)], (x - at).squaredNorm());
    for (double& gap : gaps[end]) gap = std::sqrt(gap);
    gaps[end][end / 2] = 0;
  });
  return gaps;
}

}  // namespace kvx
