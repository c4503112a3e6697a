// How tissue lies between the two images is read once for every few voxels: it turns little within them.
#include "pipeline/registration/images/shown_pair.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"
#include "core/voxels/neighbours.h"
#include "core/voxels/sample_clamped.h"
#include "pipeline/scans/alike_images.h"

namespace kvx {
namespace {

constexpr int kCellVoxels = 4;          // along each axis
constexpr double kLeastSdVoxels = 0.3;  // taps are read linearly: less is no better than none
constexpr double kLeastReachVoxels = 1;

Grid CellsOf(const Grid& grid) { return Coarsened(grid, kCellVoxels); }

// A voxel of the grid, also where the last cell is narrower.
Eigen::Vector3i MiddleOf(const Eigen::Vector3i& cell, const Grid& grid) {
  return (kCellVoxels * cell.array() + kCellVoxels / 2).min(grid.size.array() - 1).matrix();
}

// The turn nearest to the start's slope, over two voxels either way.
RigidTransform TurnAt(const Grid& grid, std::span<const Eigen::Vector3f> start_mm, const Eigen::Vector3i& p) {
  Eigen::Matrix3d slope;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3i step = 2 * Eigen::Vector3i::Unit(a);
    const Eigen::Vector3i lo = (p - step).cwiseMax(0),
                          hi = (p + step).cwiseMin(grid.size - Eigen::Vector3i::Ones());
    const Eigen::Vector3f along =
        start_mm[grid.Index(hi.x(), hi.y(), hi.z())] - start_mm[grid.Index(lo.x(), lo.y(), lo.z())];
    slope.col(a) = along.cast<double>() / ((hi - lo).sum() * grid.spacing_mm[a]);
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> parts(slope * grid.direction.transpose(),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d turn = parts.matrixU() * parts.matrixV().transpose();
  if (turn.determinant() < 0) {  // inside out: a fold
    Eigen::Matrix3d u = parts.matrixU();
    u.col(2) *= -1;
    turn = u * parts.matrixV().transpose();
  }
  return {Eigen::Quaterniond(turn), Eigen::Vector3d::Zero()};
}

struct MeanVariance {
  Eigen::Matrix3d sum_mm2 = Eigen::Matrix3d::Zero();
  int count = 0;
  MeanVariance& operator+=(const MeanVariance& other) {
    sum_mm2 += other.sum_mm2, count += other.count;
    return *this;
  }
};

// Cells that nothing was brought to take what those around them have.
Image<MeanVariance> Spread(const Image<MeanVariance>& given) {
  Image<MeanVariance> out = given;
  for (size_t c = 0; c < out.values.size(); ++c) {
    if (out.values[c].count > 0) continue;
    ForEachAround(given.grid, c, [&](size_t beside) { out.values[c] += given.values[beside]; });
  }
  return out;
}

Image<Eigen::Matrix3d> StandardDeviations(const Image<MeanVariance>& variances) {
  Image<Eigen::Matrix3d> sd_mm(variances.grid, Eigen::Matrix3d::Zero());
  for (size_t c = 0; c < sd_mm.values.size(); ++c) {
    const MeanVariance& mean = variances.values[c];
    if (mean.count == 0) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> along(mean.sum_mm2 / mean.count);
    sd_mm.values[c] = along.eigenvectors() * along.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }
  return sd_mm;
}

float MeanOfTaps(const Volume& image, const Eigen::Vector3i& p, const std::vector<BlurTap>& taps) {
  double mean = 0;
  for (const BlurTap& tap : taps)
    mean += tap.weight * SampleClamped(image, PointVox{p.cast<double>() + tap.away_voxels});
  return float(mean);
}

std::vector<BlurTap> LinearTaps(const Grid& grid, const Eigen::Matrix3d& sd_mm) {
  return BlurTaps(grid, sd_mm, kLeastSdVoxels, kLeastReachVoxels);
}

// Of noise that neighbours do not share, how much of the variance is left.
double NoiseVarianceLeft(const std::vector<BlurTap>& taps) {
  double squares = 0;
  for (const BlurTap& tap : taps) squares += tap.weight * tap.weight;
  return squares;
}

Volume Blurred(const Volume& image, const Image<Eigen::Matrix3d>& sd_mm) {
  Volume out = image;
  ParallelFor(sd_mm.values.size(), [&](size_t c) {
    const std::vector<BlurTap> taps = LinearTaps(image.grid, sd_mm.values[c]);
    if (taps.size() == 1) return;
    const Eigen::Vector3i first = kCellVoxels * sd_mm.grid.Ijk(c);
    for (int n = 0; n < kCellVoxels * kCellVoxels * kCellVoxels; ++n) {
      const Eigen::Vector3i p = first + Eigen::Vector3i(n % kCellVoxels, n / kCellVoxels % kCellVoxels,
                                                        n / (kCellVoxels * kCellVoxels));
      if (image.grid.Contains(p)) out(p.x(), p.y(), p.z()) = MeanOfTaps(image, p, taps);
    }
  });
  return out;
}

}  // namespace

ShownPair ShownAlike(const LevelImages& images, const Grid& template_grid,
                     std::span<const Eigen::Vector3f> start_mm) {
  const Grid &scan_grid = images.measured_scan.grid, &region = images.template_volume.grid;
  if (MostBlurSdMm(template_grid, scan_grid) < kLeastSdVoxels * region.spacing_mm.minCoeff())
    return {images.template_volume, images.scan};
  Image<Eigen::Matrix3d> template_sd_mm(CellsOf(region), Eigen::Matrix3d::Zero());
  Image<MeanVariance> scan_mm2(CellsOf(images.scan.grid));
  const double reach_mm = kWidestRingVoxels * region.spacing_mm.maxCoeff();
  double template_left = 0, scan_left = 0, alike_mm3 = 0, count = 0;
  for (size_t c = 0; c < template_sd_mm.values.size(); ++c) {
    const Eigen::Vector3i p = MiddleOf(template_sd_mm.grid.Ijk(c), region);
    if (images.body_distance_mm(p.x(), p.y(), p.z()) > reach_mm) continue;
    const Likening alike = Liken(template_grid, scan_grid, TurnAt(region, start_mm, p));
    template_left += NoiseVarianceLeft(LinearTaps(region, alike.a_sd_mm));
    scan_left += NoiseVarianceLeft(LinearTaps(images.scan.grid, alike.b_sd_mm));
    alike_mm3 += alike.voxel_mm3, count += 1;
    template_sd_mm.values[c] = alike.a_sd_mm;
    const PointMm start{start_mm[region.Index(p.x(), p.y(), p.z())].cast<double>()};
    const Eigen::Vector3i in_scan = images.scan.grid.ToVox(start).ijk.array().round().cast<int>();
    if (!images.scan.grid.Contains(in_scan)) continue;
    const Eigen::Vector3i cell = in_scan / kCellVoxels;
    scan_mm2(cell.x(), cell.y(), cell.z()) += {alike.b_sd_mm * alike.b_sd_mm.transpose(), 1};
  }
  return {Blurred(images.template_volume, template_sd_mm),
          Blurred(images.scan, StandardDeviations(Spread(Spread(scan_mm2)))),
          std::sqrt(template_left / std::max(1.0, count)), std::sqrt(scan_left / std::max(1.0, count)),
          alike_mm3 / std::max(1.0, count)};
}

}  // namespace kvx
