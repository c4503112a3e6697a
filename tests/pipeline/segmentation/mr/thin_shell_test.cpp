// Balls of marrow in a shell of cortex in soft tissue, each voxel the mean of many places in it.
#include "pipeline/segmentation/mr/thin_shell.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/segmentation/mr/smooth_surface.h"

namespace kvx {
namespace {

constexpr int kSide = 28;
constexpr double kRadiusMm = 14.3;
const Eigen::Vector3d kSpacingMm(1.5, 1.5, 2.0);

Grid GridOfWorld() {
  Grid grid;
  grid.size = {kSide + 4, kSide, kSide - 4};
  grid.spacing_mm = kSpacingMm;
  grid.origin = {{-3, 40, 7}};
  return grid;
}

const Eigen::Vector3d kCentreMm = Eigen::Vector3d(15.3, 13.6, 11.7).cwiseProduct(kSpacingMm);

Mask Ball(double radius_mm) {
  Mask ball(GridOfWorld());
  for (size_t v = 0; v < ball.values.size(); ++v) {
    const Eigen::Vector3d mm = ball.grid.Ijk(v).cast<double>().cwiseProduct(kSpacingMm);
    ball.values[v] = (mm - kCentreMm).norm() < radius_mm;
  }
  return ball;
}

double AllAround(const Eigen::Vector3d&) { return 1; }
double ThinOnOneSide(const Eigen::Vector3d& out) { return out.x() > 0 ? 1 : 0.5; }

// Box of a voxel, and as much again of the scanner's. `share`: of the thickness, in a direction.
Volume Scan(double thickness_mm, double (*share)(const Eigen::Vector3d&) = AllAround) {
  constexpr int kPlaces = 6;
  Volume scan(GridOfWorld());
  for (size_t v = 0; v < scan.values.size(); ++v) {
    double sum = 0;
    for (int n = 0; n < kPlaces * kPlaces * kPlaces; ++n) {
      const Eigen::Vector3d place(n % kPlaces, n / kPlaces % kPlaces, n / kPlaces / kPlaces);
      const Eigen::Vector3d offset = 1.5 * ((place.array() + 0.5) / kPlaces - 0.5);
      const Eigen::Vector3d mm =
          (scan.grid.Ijk(v).cast<double>() + offset).cwiseProduct(kSpacingMm) - kCentreMm;
      const double depth_mm = kRadiusMm - mm.norm();
      sum += depth_mm > thickness_mm * share(mm) ? 1.0 : depth_mm > 0 ? 0.1 : 0.6;
    }
    scan.values[v] = float(sum / (kPlaces * kPlaces * kPlaces));
  }
  return scan;
}

double Voxels(const Mask& mask) {
  return double(std::count(mask.values.begin(), mask.values.end(), uint8_t(1)));
}

double Dice(const Mask& a, const Mask& b) {
  double both = 0;
  for (size_t v = 0; v < a.values.size(); ++v) both += a.values[v] && b.values[v];
  return 2 * both / (Voxels(a) + Voxels(b));
}

TEST(ThinShell, ASurfaceAVoxelTooFarOutOrInIsPutRight) {
  const Mask truth = Ball(kRadiusMm);
  for (const double error_mm : {-1.2, 1.2}) {
    const Mask start = Ball(kRadiusMm + error_mm);
    ASSERT_LT(Dice(start, truth), 0.9);
    const ThinShell shell = FitThinShells({{Scan(1.0), start, Ball(kRadiusMm - 1.0)}}).at(0);
    EXPECT_FALSE(shell.resolved);
    EXPECT_NEAR(shell.thickness_voxels * truth.grid.MeanSpacingMm(), 1.0, 0.4);
    EXPECT_GT(Dice(shell.mask, truth), 0.955) << error_mm;
    const double quarter_mm = 0.25 * truth.grid.MeanSpacingMm();
    EXPECT_NEAR(Voxels(shell.mask) / Voxels(truth), 1, 3 * quarter_mm / kRadiusMm) << error_mm;
  }
}

// By how much the mask is larger than the truth on one side, in millimetres of its surface.
double TooFarOutMm(const Mask& mask, const Mask& truth, bool right) {
  const double voxel_mm3 = kSpacingMm.prod(), side_mm2 = 2 * M_PI * kRadiusMm * kRadiusMm;
  double more = 0;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if ((mask.grid.Ijk(v).x() * kSpacingMm.x() > kCentreMm.x()) == right)
      more += double(mask.values[v]) - truth.values[v];
  }
  return more * voxel_mm3 / side_mm2;
}

TEST(ThinShell, OneSideMayBeThinner) {
  const Mask truth = Ball(kRadiusMm);
  const ThinShell shell =
      FitThinShells({{Scan(1.5, ThinOnOneSide), Ball(kRadiusMm + 1.2), Ball(kRadiusMm - 1.5)}}).at(0);
  EXPECT_FALSE(shell.resolved);
  const double close_mm = truth.grid.MeanSpacingMm() * 0.4;
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, true), 0, close_mm);
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, false), 0, close_mm);
}

// A dark band, thicker than a voxel, lies on the shell on one side, and the start took it for the bone's own.
TEST(ThinShell, ATendonBesideTheBoneIsLeftOut) {
  const Mask truth = Ball(kRadiusMm);
  Volume scan = Scan(1.0);
  Mask start = truth;
  for (size_t v = 0; v < start.values.size(); ++v) {
    const Eigen::Vector3d mm = scan.grid.Ijk(v).cast<double>().cwiseProduct(kSpacingMm) - kCentreMm;
    const double beyond_mm = mm.norm() - kRadiusMm;
    if (mm.x() < 0.9 * mm.norm() || beyond_mm <= 0 || beyond_mm > 3.5) continue;
    scan.values[v] = std::min(scan.values[v], 0.2f), start.values[v] = 1;
  }
  ASSERT_GT(TooFarOutMm(start, truth, true), 0.25);
  const ThinShell shell = FitThinShells({{scan, start, Ball(kRadiusMm - 1.0)}}).at(0);
  EXPECT_FALSE(shell.resolved);
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, true), 0, 0.1);
}

TEST(ThinShell, AShellThatIsSeenByItselfStays) {
  const Mask start = Ball(kRadiusMm + 0.5);
  const ThinShell shell = FitThinShells({{Scan(4.5), start, Ball(kRadiusMm - 4.5)}}).at(0);
  EXPECT_TRUE(shell.resolved);
  EXPECT_EQ(shell.mask.values, start.values);
}

TEST(ThinShell, WhatHasNoMarrowIsTakenOffWhole) {
  const ThinShell shell = FitThinShells({{Scan(1.0), Ball(kRadiusMm), Mask(GridOfWorld())}}).at(0);
  EXPECT_FALSE(shell.resolved);
  EXPECT_EQ(Voxels(shell.mask), 0);
}

TEST(ThinShell, NothingStaysNothing) {
  EXPECT_TRUE(FitThinShells({}).empty());
  const ThinShell shell = FitThinShells({{Scan(1.0), Mask(GridOfWorld()), Mask(GridOfWorld())}}).at(0);
  EXPECT_TRUE(shell.resolved);
  EXPECT_EQ(Voxels(shell.mask), 0);
}

TEST(SmoothSurface, PointsOfABallLieOnItAndLookOutwards) {
  const SmoothSurface surface(Ball(kRadiusMm));
  ASSERT_GT(surface.points().size(), 1000u);
  double mean_mm = 0;
  for (const SurfacePoint& point : surface.points()) {
    const Eigen::Vector3d out = point.at_mm - kCentreMm;
    EXPECT_NEAR(out.norm(), kRadiusMm, 1.0);
    EXPECT_GT(point.outwards.dot(out.normalized()), 0.9);
    mean_mm += out.norm() / double(surface.points().size());
  }
  EXPECT_NEAR(mean_mm, kRadiusMm, 0.25);
}

TEST(SmoothSurface, PointsKnowTheDepthUnderThem) {
  constexpr double kSmallMm = 5;
  const SmoothSurface surface(Ball(kSmallMm));
  double mean_mm = 0;
  for (const SurfacePoint& point : surface.points())
    mean_mm += point.depth_mm / double(surface.points().size());
  EXPECT_NEAR(mean_mm, kSmallMm, 1.0);
}

TEST(SmoothSurface, AVoxelKnowsHowFarItIsBeyond) {
  const Mask ball = Ball(kRadiusMm);
  const SmoothSurface surface(ball);
  const auto at = [&](int i) { return surface.Under(ball.grid.Index(i, 14, 12)); };
  for (const int i : {24, 25, 26}) {
    const double mm = (Eigen::Vector3d(i, 14, 12).cwiseProduct(kSpacingMm) - kCentreMm).norm();
    ASSERT_TRUE(at(i)) << i;
    EXPECT_NEAR(at(i)->beyond_mm, mm - kRadiusMm, 0.7);
  }
  EXPECT_FALSE(at(15));
}

}  // namespace
}  // namespace kvx
