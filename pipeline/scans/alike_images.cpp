// A voxel is taken to show the mean over its box: variances width^2 / 12 along its axes.
#include "pipeline/scans/alike_images.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/voxels/finer_grid.h"

namespace kvx {
namespace {

constexpr double kLeastSdVoxels = 0.1;  // less does not show
// Gauss-Hermite quadrature at three places, exact for polynomials up to the fifth degree.
constexpr double kTapSd = 1.7320508075688772;

Eigen::Vector3d BoxVariancesMm2(const Grid& grid) { return grid.spacing_mm.array().square() / 12; }

Eigen::Matrix3d BoxVarianceMm2(const Grid& grid) {
  return grid.direction * BoxVariancesMm2(grid).asDiagonal() * grid.direction.transpose();
}

bool HasThickSlices(const Grid& grid) { return (TimesTowardsCubes(grid).array() > 1).any(); }

}  // namespace

Likening Liken(const Grid& a, const Grid& b, const RigidTransform& b_from_a) {
  Likening out;
  const Eigen::Matrix3d turn = b_from_a.rotation.toRotationMatrix();
  const Eigen::Matrix3d a_mm2 = BoxVarianceMm2(a), b_mm2 = turn.transpose() * BoxVarianceMm2(b) * turn;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> differing(b_mm2 - a_mm2);
  const Eigen::Vector3d b_wider = differing.eigenvalues().cwiseMax(0.0),
                        a_wider = (-differing.eigenvalues()).cwiseMax(0.0);
  out.a_sd_mm = differing.eigenvectors() * b_wider.cwiseSqrt().asDiagonal();
  out.b_sd_mm = turn * differing.eigenvectors() * a_wider.cwiseSqrt().asDiagonal();
  out.voxel_mm3 = std::sqrt((12 * (a_mm2 + out.a_sd_mm * out.a_sd_mm.transpose())).determinant());
  return out;
}

double MostBlurSdMm(const Grid& a, const Grid& b) {
  const Eigen::Vector3d a_mm2 = BoxVariancesMm2(a), b_mm2 = BoxVariancesMm2(b);
  return std::sqrt(std::max({0.0, b_mm2.maxCoeff() - a_mm2.minCoeff(), a_mm2.maxCoeff() - b_mm2.minCoeff()}));
}

Likening LikenThickSlices(const Grid& a, const Grid& b, const RigidTransform& b_from_a) {
  if (HasThickSlices(a) || HasThickSlices(b)) return Liken(a, b, b_from_a);
  return {.voxel_mm3 = std::max(a.spacing_mm.prod(), b.spacing_mm.prod())};
}

std::vector<BlurTap> BlurTaps(const Grid& grid, const Eigen::Matrix3d& sd_mm, double least_sd_voxels,
                              double least_reach_voxels) {
  std::vector<BlurTap> taps = {{Eigen::Vector3d::Zero(), 1.0}};
  for (int c = 0; c < 3; ++c) {
    const Eigen::Vector3d sd_voxels = grid.VoxFromMm() * sd_mm.col(c);
    const double sd = sd_voxels.norm();
    if (sd < least_sd_voxels) continue;
    const double reach_sd = std::max(kTapSd, least_reach_voxels / sd);
    const double side_weight = 0.5 / (reach_sd * reach_sd);  // so that the variance is sd^2
    std::vector<BlurTap> spread;
    for (const BlurTap& tap : taps) {
      for (const int side : {-1, 0, 1}) {
        spread.push_back({tap.away_voxels + side * reach_sd * sd_voxels,
                          tap.weight * (side == 0 ? 1 - 2 * side_weight : side_weight)});
      }
    }
    taps = std::move(spread);
  }
  return taps;
}

BlurredImage::BlurredImage(const CubicImage& image, const Eigen::Matrix3d& sd_mm)
    : image_(image), taps_(BlurTaps(image.grid(), sd_mm, kLeastSdVoxels, 0)) {}

bool BlurredImage::At(const Eigen::Vector3d& p, double& value, Eigen::Vector3d& gradient) const {
  if (!blurs()) return image_.At(p, value, gradient);
  const Eigen::Vector3d last = grid().size.cast<double>().array() - 1;
  if ((p.array() < 0).any() || (p.array() > last.array()).any()) return false;
  double mean = 0;
  Eigen::Vector3d mean_gradient = Eigen::Vector3d::Zero();
  for (const BlurTap& tap : taps_) {
    image_.At((p + tap.away_voxels).cwiseMax(0.0).cwiseMin(last), value, gradient);
    mean += tap.weight * value, mean_gradient += tap.weight * gradient;
  }
  value = mean, gradient = mean_gradient;
  return true;
}

}  // namespace kvx
