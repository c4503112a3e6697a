// Principal axes of the covariance of the bone's voxels.
#include "pipeline/bones/bone_set/oriented_box.h"

#include <Eigen/Eigenvalues>

#include "core/errors.h"
#include "core/voxel_box.h"

namespace kvx {
namespace {

std::vector<Eigen::Vector3d> PlacesOf(const LabelMap& labels, int label) {
  std::vector<Eigen::Vector3d> places;
  ForEachVoxel(BoxOf(labels, label), labels.grid, [&](const auto&, size_t, size_t v) {
    if (labels.values[v] == label)
      places.push_back(labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()}).lps);
  });
  return places;
}

Eigen::Vector3d MeanOf(const std::vector<Eigen::Vector3d>& places) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : places) sum += x;
  return sum / double(places.size());
}

// Long axis first. It points away from the parent; the second axis has its largest component positive; the
// third makes the frame right-handed. Only the long axis looks at the parent, so noise in a round
// cross-section cannot flip the bone.
Eigen::Matrix3d AxesOf(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& mean,
                       const Eigen::Vector3d& towards_parent) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : places) covariance += (x - mean) * (x - mean).transpose();
  // Ascending
  const Eigen::Matrix3d by_size = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors();
  Eigen::Matrix3d axes;
  axes.col(0) = by_size.col(2);
  if (axes.col(0).dot(mean - towards_parent) < 0) axes.col(0) *= -1;
  axes.col(1) = by_size.col(1);
  Eigen::Index largest;
  axes.col(1).cwiseAbs().maxCoeff(&largest);
  if (axes(largest, 1) < 0) axes.col(1) *= -1;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace

OrientedBox FitOrientedBox(const LabelMap& labels, int label, const PointMm& towards_parent) {
  const std::vector<Eigen::Vector3d> places = PlacesOf(labels, label);
  if (places.empty())
    throw InputError("label " + std::to_string(label) + " has no voxels on the template's grid");
  const Eigen::Vector3d mean = MeanOf(places);
  OrientedBox box;
  box.axes = AxesOf(places, mean, towards_parent.lps);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
  for (const Eigen::Vector3d& x : places) {
    const Eigen::Vector3d along = box.axes.transpose() * (x - mean);
    low = low.cwiseMin(along);
    high = high.cwiseMax(along);
  }
  // Voxels are not points: half a voxel is added at each side.
  const Eigen::Vector3d voxel_mm =
      (labels.grid.MmFromVox().transpose() * box.axes).colwise().norm().transpose();
  box.extent_mm = high - low + voxel_mm;
  const Eigen::Vector3d centre = mean + box.axes * (0.5 * (low + high));
  box.origin = PointMm{centre - 0.5 * box.extent_mm[0] * box.axes.col(0)};
  return box;
}

}  // namespace kvx
