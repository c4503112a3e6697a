// Balls of marrow in a shell of cortex in soft tissue, each voxel the mean of many places in it.
#include "pipeline/segmentation/mr/shells/place_shells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/segmentation/mr/shells/smooth_surface.h"

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

Mask Ball(double radius_mm, const Eigen::Vector3d& aside_mm = Eigen::Vector3d::Zero()) {
  Mask ball(GridOfWorld());
  for (size_t v = 0; v < ball.values.size(); ++v) {
    const Eigen::Vector3d mm = ball.grid.Ijk(v).cast<double>().cwiseProduct(kSpacingMm);
    ball.values[v] = (mm - kCentreMm - aside_mm).norm() < radius_mm;
  }
  return ball;
}

double AllAround(const Eigen::Vector3d&) { return 1; }
double ThinOnOneSide(const Eigen::Vector3d& out) { return out.x() > 0 ? 1 : 0.5; }

// Box of a voxel, and as much again of the scanner's. `share`: of the thickness, in a direction.
Volume Scan(double thickness_mm, double (*share)(const Eigen::Vector3d&) = AllAround,
            double radius_mm = kRadiusMm) {
  constexpr int kPlaces = 6;
  Volume scan(GridOfWorld());
  for (size_t v = 0; v < scan.values.size(); ++v) {
    double sum = 0;
    for (int n = 0; n < kPlaces * kPlaces * kPlaces; ++n) {
      const Eigen::Vector3d place(n % kPlaces, n / kPlaces % kPlaces, n / kPlaces / kPlaces);
      const Eigen::Vector3d offset = 1.5 * ((place.array() + 0.5) / kPlaces - 0.5);
      const Eigen::Vector3d mm =
          (scan.grid.Ijk(v).cast<double>() + offset).cwiseProduct(kSpacingMm) - kCentreMm;
      const double depth_mm = radius_mm - mm.norm();
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

TEST(PlaceShells, ASurfaceAVoxelTooFarOutOrInIsPutRight) {
  const Mask truth = Ball(kRadiusMm);
  for (const double error_mm : {-1.2, 1.2}) {
    const Mask start = Ball(kRadiusMm + error_mm);
    ASSERT_LT(Dice(start, truth), 0.9);
    const PlacedShell shell = PlaceShells({{Scan(1.0), start, Ball(kRadiusMm - 1.0)}}).at(0);
    EXPECT_FALSE(shell.resolved);
    EXPECT_NEAR(shell.thickness_voxels * truth.grid.MeanSpacingMm(), 1.0, 0.4);
    EXPECT_GT(Dice(shell.mask, truth), 0.955) << error_mm;
    const double quarter_mm = 0.25 * truth.grid.MeanSpacingMm();
    EXPECT_NEAR(Voxels(shell.mask) / Voxels(truth), 1, 3 * quarter_mm / kRadiusMm) << error_mm;
  }
}

Eigen::Vector3d MiddleMm(const Mask& mask) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (mask.values[v]) sum += mask.grid.Ijk(v).cast<double>().cwiseProduct(kSpacingMm);
  }
  return sum / Voxels(mask);
}

// A bone six voxels thick, as a finger's: what pulls at one side must not push at the other.
TEST(PlaceShells, ASmallBoneThatLiesAsideIsPutRight) {
  constexpr double kSmallMm = 5, kAsideMm = 1.2;
  const Mask truth = Ball(kSmallMm);
  const Volume scan = Scan(1.0, AllAround, kSmallMm);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d aside_mm = kAsideMm * Eigen::Vector3d::Unit(axis);
    const Mask start = Ball(kSmallMm, aside_mm);
    const PlacedShell shell = PlaceShells({{scan, start, Ball(kSmallMm - 1.5, aside_mm)}}).at(0);
    ASSERT_LT(Dice(start, truth), 0.86) << axis;
    EXPECT_GT(Dice(shell.mask, truth), 0.95) << axis;
    EXPECT_NEAR((MiddleMm(shell.mask) - MiddleMm(truth)).norm(), 0, 0.2) << axis;
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

TEST(PlaceShells, OneSideMayBeThinner) {
  const Mask truth = Ball(kRadiusMm);
  const PlacedShell shell =
      PlaceShells({{Scan(1.5, ThinOnOneSide), Ball(kRadiusMm + 1.2), Ball(kRadiusMm - 1.5)}}).at(0);
  EXPECT_FALSE(shell.resolved);
  const double close_mm = truth.grid.MeanSpacingMm() * 0.4;
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, true), 0, close_mm);
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, false), 0, close_mm);
}

// A dark band, thicker than a voxel, lies on the shell on one side, and the start took it for the bone's own.
TEST(PlaceShells, ATendonBesideTheBoneIsLeftOut) {
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
  const PlacedShell shell = PlaceShells({{scan, start, Ball(kRadiusMm - 1.0)}}).at(0);
  EXPECT_FALSE(shell.resolved);
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, true), 0, 0.15);
}

TEST(PlaceShells, ASurfaceOfWhichNothingIsSeenStays) {
  const Mask truth = Ball(kRadiusMm);
  Volume scan = Scan(1.0);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    if (scan.grid.Ijk(v).x() * kSpacingMm.x() > kCentreMm.x()) scan.values[v] = NAN;
  }
  const PlacedShell shell = PlaceShells({{scan, truth, Ball(kRadiusMm - 1.0)}}).at(0);
  EXPECT_FALSE(shell.resolved);
  EXPECT_NEAR(TooFarOutMm(shell.mask, truth, true), 0, 0.25);
}

// A search ended at the marrow, on a side of which nothing is seen, too: the shell there is as thick as it is
// elsewhere.
TEST(PlaceShells, AShellIsFilledWhereNothingIsSeenOfIt) {
  const Mask truth = Ball(kRadiusMm), marrow = Ball(kRadiusMm - 1.0);
  Volume scan = Scan(1.0);
  Mask unseen(truth.grid);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    unseen.values[v] = scan.grid.Ijk(v).x() * kSpacingMm.x() > kCentreMm.x() + 0.5 * kRadiusMm;
    if (unseen.values[v]) scan.values[v] = NAN;
  }
  const auto missing = [&](const Mask& mask) {
    double voxels = 0;
    for (size_t v = 0; v < unseen.values.size(); ++v)
      voxels += unseen.values[v] * (double(truth.values[v]) - mask.values[v]);
    return voxels;
  };
  const PlacedShell shell = PlaceShells({{scan, marrow, marrow}}).at(0);
  EXPECT_FALSE(shell.resolved);
  EXPECT_GT(Dice(shell.mask, truth), 0.955);
  EXPECT_LT(std::abs(missing(shell.mask)), 0.3 * missing(marrow));
}

// By the radius of a ball as large.
double RadiusMm(const Mask& mask) { return std::cbrt(Voxels(mask) * kSpacingMm.prod() * 3 / (4 * M_PI)); }

// A shell of two voxels and more, whose marrow is out of sight in part.
TEST(PlaceShells, AShellThatIsSeenByItselfIsPlacedToo) {
  const Mask truth = Ball(kRadiusMm);
  for (const double thickness_mm : {2.5, 4.5}) {
    for (const double error_mm : {-0.8, 0.8}) {
      const Mask start = Ball(kRadiusMm + error_mm);
      const PlacedShell shell =
          PlaceShells({{Scan(thickness_mm), start, Ball(kRadiusMm - thickness_mm)}}).at(0);
      EXPECT_TRUE(shell.resolved);
      EXPECT_NEAR(RadiusMm(shell.mask), RadiusMm(truth), 0.2) << thickness_mm << " " << error_mm;
      EXPECT_GT(Dice(shell.mask, truth), 0.97) << thickness_mm << " " << error_mm;
    }
  }
}

double ThickOnOneSide(const Eigen::Vector3d& out) { return out.x() > 0 ? 1 : 0.4; }

// As a shaft and its ends: thicker than any marrow in sight here, and what is usual there.
TEST(PlaceShells, AShellThatIsThickOnOneSideLosesNothingThere) {
  const Mask truth = Ball(kRadiusMm);
  const PlacedShell shell =
      PlaceShells({{Scan(6.0, ThickOnOneSide), Ball(kRadiusMm - 0.5), Ball(kRadiusMm - 6.0)}}).at(0);
  EXPECT_TRUE(shell.resolved);
  for (const bool right : {true, false}) EXPECT_NEAR(TooFarOutMm(shell.mask, truth, right), 0, 0.25) << right;
}

double ThickAtOnePole(const Eigen::Vector3d& out) { return out.x() > 0.75 * out.norm() ? 1 : 0.2; }

// Nearly all of a long bone's shell may be thin: its thick part is none of a tendon for that.
TEST(PlaceShells, OfALongBoneTheThickPartStays) {
  const Mask truth = Ball(kRadiusMm);
  Mask marrow(truth.grid);
  const Volume scan = Scan(6.0, ThickAtOnePole);
  for (size_t v = 0; v < marrow.values.size(); ++v)
    marrow.values[v] = truth.values[v] && scan.values[v] > 0.7;
  const auto too_far_out_mm = [&](bool small) {
    const PlacedShell shell = PlaceShells({{scan, truth, marrow, small}}).at(0);
    EXPECT_EQ(shell.resolved, !small);
    return TooFarOutMm(shell.mask, truth, true);
  };
  EXPECT_LT(too_far_out_mm(true), -0.5);
  EXPECT_NEAR(too_far_out_mm(false), 0, 0.25);
}

// The half of a ball that was found ends in marrow, where nothing says that the bone does.
TEST(PlaceShells, AnEndWithoutAShellStays) {
  Mask half = Ball(kRadiusMm), marrow = Ball(kRadiusMm - 2.5);
  for (size_t v = 0; v < half.values.size(); ++v) {
    if (half.grid.Ijk(v).x() * kSpacingMm.x() < kCentreMm.x()) half.values[v] = marrow.values[v] = 0;
  }
  const PlacedShell shell = PlaceShells({{Scan(2.5), half, marrow}}).at(0);
  for (size_t v = 0; v < half.values.size(); ++v) {
    EXPECT_TRUE(!marrow.values[v] || shell.mask.values[v]) << half.grid.Ijk(v).transpose();
  }
}

// What leaked out between pieces was taken off the bone, not off its marrow.
TEST(PlaceShells, MarrowThatIsNotInTheBoneIsNotPutBack) {
  const Mask truth = Ball(kRadiusMm);
  Mask marrow = Ball(kRadiusMm - 2.5);
  for (size_t v = 0; v < marrow.values.size(); ++v) marrow.values[v] |= marrow.grid.Ijk(v).z() < 2;
  const PlacedShell shell = PlaceShells({{Scan(2.5), truth, marrow}}).at(0);
  for (size_t v = 0; v < marrow.values.size(); ++v) {
    const Eigen::Vector3i p = marrow.grid.Ijk(v);
    EXPECT_FALSE(p.z() < 2 && shell.mask.values[v]) << p.transpose();
  }
}

TEST(PlaceShells, WhatHasNoMarrowIsTakenOffWhole) {
  const PlacedShell shell = PlaceShells({{Scan(1.0), Ball(kRadiusMm), Mask(GridOfWorld())}}).at(0);
  EXPECT_FALSE(shell.resolved);
  EXPECT_EQ(Voxels(shell.mask), 0);
}

TEST(PlaceShells, NothingStaysNothing) {
  EXPECT_TRUE(PlaceShells({}).empty());
  const PlacedShell shell = PlaceShells({{Scan(1.0), Mask(GridOfWorld()), Mask(GridOfWorld())}}).at(0);
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

double ChosenPerMm2(const SmoothSurface& surface, double area_mm2) {
  return double(std::ranges::count(surface.points(), true, &SurfacePoint::chosen)) / area_mm2;
}

TEST(SmoothSurface, OneInFourIsChosenOnAllSidesAlike) {
  const SmoothSurface surface(Ball(kRadiusMm));
  const double all_mm2 = 4 * M_PI * kRadiusMm * kRadiusMm, per_mm2 = ChosenPerMm2(surface, all_mm2);
  EXPECT_NEAR(per_mm2 * all_mm2 / double(surface.points().size()), 0.25, 0.01);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      int all = 0, chosen = 0;
      for (const SurfacePoint& point : surface.points()) {
        if (sign * point.outwards[axis] > 0.9) ++all, chosen += point.chosen;
      }
      EXPECT_NEAR(chosen, 0.25 * all, 0.03 * all) << axis << " " << sign;
    }
  }
}

TEST(SmoothSurface, OfALargeOneOnlyTheChosenPointsStay) {
  Grid grid;
  grid.size = {80, 80, 80};
  Mask ball(grid);
  for (size_t v = 0; v < ball.values.size(); ++v)
    ball.values[v] = (grid.Ijk(v).cast<double>() - Eigen::Vector3d::Constant(39.6)).norm() < 35;
  const SmoothSurface large(ball), small(Ball(kRadiusMm));
  EXPECT_TRUE(std::ranges::all_of(large.points(), &SurfacePoint::chosen));
  const double small_voxels2 = 4 * M_PI * std::pow(kRadiusMm / std::cbrt(kSpacingMm.prod()), 2);
  EXPECT_NEAR(ChosenPerMm2(large, 4 * M_PI * 35 * 35) / ChosenPerMm2(small, small_voxels2), 1, 0.1);
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
