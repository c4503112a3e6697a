// Balls of marrow in dark walls, in fat as bright as marrow.
#include "pipeline/segmentation/mr/search/closed_blobs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace kvx {
namespace {

using Place = Eigen::Vector3d;

constexpr double kRadiusMm = 6, kWallMm = 2.4, kMostMm = 20;
const Place kSpacing(1.2, 1.2, 1.5);

struct Ball {
  Place centre_mm;
  double radius_mm = kRadiusMm;  // with the wall
};

double Grey(const Place& mm, const std::vector<Ball>& balls) {
  for (const Ball& ball : balls) {
    const double inside = ball.radius_mm - (mm - ball.centre_mm).norm();
    if (inside > 0) return inside > kWallMm ? 1.0 : 0.2;
  }
  return 0.95;
}

// Of eight places a voxel.
Volume BallsInFat(const std::vector<Ball>& balls, double noise) {
  Grid grid;
  grid.size = {50, 40, 26}, grid.spacing_mm = kSpacing;
  Volume scan(grid);
  std::mt19937 random(3);
  std::normal_distribution<double> deviate(0, noise);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    double sum = 0;
    for (int s = 0; s < 8; ++s) {
      const Place offset(s & 1 ? .25 : -.25, s & 2 ? .25 : -.25, s & 4 ? .25 : -.25);
      sum += Grey((grid.Ijk(v).cast<double>() + offset).cwiseProduct(kSpacing), balls);
    }
    scan.values[v] = float(sum / 8 + deviate(random));
  }
  return scan;
}

Mask WholeOf(const Volume& scan) { return Mask(scan.grid, 1); }

std::vector<ClosedBlob> WellClosed(const Volume& scan) {
  std::vector<ClosedBlob> blobs = FindClosedBlobs(scan, WholeOf(scan), kMostMm);
  std::erase_if(blobs, [](const ClosedBlob& blob) { return blob.closed < 0.95 || blob.aside > 0.1; });
  return blobs;
}

TEST(ClosedBlobs, ABallInAWallIsFoundWhereItIs) {
  const Place centre(26.3, 20.1, 19.4);
  for (const double noise : {0.0, 0.05}) {
    const std::vector<ClosedBlob> blobs = WellClosed(BallsInFat({{centre}}, noise));
    ASSERT_FALSE(blobs.empty()) << noise;
    EXPECT_LT((blobs[0].centre_mm - centre).norm(), 0.6) << noise;
    EXPECT_GT(blobs[0].radius_mm, kRadiusMm - kWallMm - 0.3) << noise;  // somewhere in the wall
    EXPECT_LT(blobs[0].radius_mm, kRadiusMm) << noise;
    EXPECT_GT(blobs[0].closed, 0.98) << noise;
  }
}

TEST(ClosedBlobs, NoneIsFoundWhereNoWallIs) { EXPECT_TRUE(WellClosed(BallsInFat({}, 0.03)).empty()); }

// A tube of marrow that goes out of the scan on both sides.
TEST(ClosedBlobs, WhatIsOpenOnTwoSidesIsNone) {
  Volume scan = BallsInFat({}, 0);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Place mm = scan.grid.Ijk(v).cast<double>().cwiseProduct(kSpacing);
    const double inside = kRadiusMm - (mm - Place(0, 22, 19)).tail<2>().norm();
    if (inside > 0) scan.values[v] = inside > kWallMm ? 1.0f : 0.2f;
  }
  EXPECT_TRUE(WellClosed(scan).empty());
}

TEST(ClosedBlobs, TwoBallsAreTwo) {
  const Place a(20, 20, 19), b(32, 22, 19);
  const Volume scan = BallsInFat({{a}, {b}}, 0.03);
  const std::vector<ClosedBlob> blobs = WellClosed(scan);
  for (const Place& centre : {a, b}) {
    EXPECT_TRUE(std::ranges::any_of(
        blobs, [&](const ClosedBlob& blob) { return (blob.centre_mm - centre).norm() < 0.8; }));
  }
  EXPECT_TRUE(IsWalled(scan, a, b));
  EXPECT_FALSE(IsWalled(scan, a - Place(2, 0, 0), a + Place(2, 0, 0)));
}

TEST(ClosedBlobs, OnlyTheMaskIsSearched) {
  const Volume scan = BallsInFat({{Place(26, 20, 19)}}, 0.03);
  Mask corner(scan.grid);
  for (size_t v = 0; v < corner.values.size(); ++v) corner.values[v] = scan.grid.Ijk(v).maxCoeff() < 8;
  EXPECT_TRUE(FindClosedBlobs(scan, corner, kMostMm).empty());
}

}  // namespace
}  // namespace kvx
