// Principal axes of the covariance of the bone's voxels; those that are alike lie as the guide has it.
#include "pipeline/bones/bone_set/oriented_box.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/errors.h"
#include "core/voxels/voxel_box.h"

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

// 0 for axes that a bone's shape tells apart, 1 for those that noise may swap, by the ratio of variances.
double Alike(double smaller, double larger) {
  constexpr double kApart = 0.7, kSwapped = 0.9;
  return std::clamp((smaller / larger - kApart) / (kSwapped - kApart), 0.0, 1.0);
}

// The longest principal axis, to either side; among axes as long, the one along `wish`, of length 1, as where
// there is no extent at all.
Eigen::Vector3d LongestAlong(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& wish) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> ascending(covariance);
  const Eigen::Matrix3d& axes = ascending.eigenvectors();
  const Eigen::Vector3d& variances = ascending.eigenvalues();
  const double most = variances[2];
  constexpr double kNoneMm2 = 1e-6;  // rounding; one voxel off the rest has more
  if (most < kNoneMm2) return wish;
  const Eigen::Vector3d share(Alike(variances[0], most), Alike(variances[1], most), 1);
  const Eigen::Vector3d pulled = axes * share.cwiseProduct(axes.transpose() * wish);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance + most * pulled * pulled.transpose())
      .eigenvectors()
      .col(2);
}

// Perpendicular to `along`, of length 1: the wished way across where there is one, else of the world.
Eigen::Vector3d AcrossOf(const BoxGuide& guide, const Eigen::Vector3d& along) {
  constexpr double kEnough = 0.3;  // of a direction's length that is left when it is made perpendicular
  const Eigen::Vector3d handed_down =
      guide.along.isZero()
          ? guide.across
          : Eigen::Vector3d(Eigen::Quaterniond::FromTwoVectors(guide.along, along) * guide.across);
  const auto made_perpendicular = [&](const Eigen::Vector3d& way) -> Eigen::Vector3d {
    return way - way.dot(along) * along;
  };
  for (const Eigen::Vector3d& way : {handed_down, Eigen::Vector3d(Eigen::Vector3d::UnitX())}) {
    const Eigen::Vector3d left = made_perpendicular(way);
    if (left.norm() > kEnough * way.norm()) return left.normalized();
  }
  return made_perpendicular(Eigen::Vector3d::UnitY()).normalized();
}

// What tells the sign of an axis that most likely lies along `first` or along `second`: across neither, so
// that in both cases noise does not turn it over.
Eigen::Vector3d Between(const Eigen::Vector3d& first, const Eigen::Vector3d& second) {
  return first + 0.5 * second;
}

// The long axis points away from the parent.
Eigen::Matrix3d AxesOf(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& from_parent,
                       const BoxGuide& guide) {
  const Eigen::Vector3d outwards = Between(from_parent.normalized(), guide.along);
  Eigen::Matrix3d axes;
  axes.col(0) = LongestAlong(covariance, outwards.normalized());
  if (axes.col(0).dot(outwards) < 0) axes.col(0) *= -1;
  const Eigen::Matrix3d flat = Eigen::Matrix3d::Identity() - axes.col(0) * axes.col(0).transpose();
  const Eigen::Vector3d across = AcrossOf(guide, axes.col(0));
  axes.col(1) = LongestAlong(flat * covariance * flat, across);
  if (axes.col(1).dot(Between(across, axes.col(0).cross(across))) < 0) axes.col(1) *= -1;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

Eigen::Matrix3d CovarianceOf(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& mean) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : places) covariance += (x - mean) * (x - mean).transpose();
  return covariance;
}

}  // namespace

OrientedBox FitOrientedBox(const LabelMap& labels, int label, const BoxGuide& guide) {
  const std::vector<Eigen::Vector3d> places = PlacesOf(labels, label);
  if (places.empty())
    throw InputError("label " + std::to_string(label) + " has no voxels on the template's grid");
  const Eigen::Vector3d mean = MeanOf(places);
  OrientedBox box;
  box.axes = AxesOf(CovarianceOf(places, mean), mean - guide.towards_parent.lps, guide);
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
