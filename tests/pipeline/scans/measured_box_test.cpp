// Sides that a program filled up are told from air of one value.
#include "pipeline/scans/measured_box.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

Volume Filled(const Volume& scan, const Eigen::Vector3i& before, const Eigen::Vector3i& after, float value) {
  Grid grid = scan.grid;
  grid.size += before + after;
  grid.origin = scan.grid.ToMm(PointVox{-before.cast<double>()});
  Volume out(grid, value);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v) + before;
    out(p.x(), p.y(), p.z()) = scan.values[v];
  }
  return out;
}

Volume Noise(const Eigen::Vector3i& size) {
  Volume scan(ObliqueGrid(size));
  std::mt19937 random(1);
  std::normal_distribution<float> noise(50, 5);
  for (float& value : scan.values) value = noise(random);
  return scan;
}

// A thigh along y that narrows to a rounded end, bright in air of zeros; cut off at y = 0.
Volume LimbInMaskedAir() {
  Volume scan(ObliqueGrid({24, 40, 24}));
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d p = scan.grid.Ijk(v).cast<double>() - Eigen::Vector3d(11.5, 0, 11.5);
    const double radius = 10 * std::sqrt(std::max(0.0, 1 - p.y() * p.y() / (33.0 * 33.0)));
    scan.values[v] = std::hypot(p.x(), p.z()) < radius ? 100.0f : 0.0f;
  }
  return scan;
}

void ExpectBox(const VoxelBox& box, const Eigen::Vector3i& first, const Eigen::Vector3i& last) {
  EXPECT_EQ(box.low, first);
  EXPECT_EQ(box.high, last + Eigen::Vector3i::Ones());
}

TEST(MeasuredBox, LeavesOutFilledSidesBesideNoise) {
  const Volume scan = Noise({9, 10, 11});
  const Volume filled = Filled(scan, {1, 0, 3}, {0, 2, 1}, -2000);
  const VoxelBox box = MeasuredBoxOf(filled);
  ExpectBox(box, {1, 0, 3}, {9, 9, 13});
  const OwnOrLent<Volume> measured = Measured(filled);
  EXPECT_EQ(measured->values, scan.values);
  EXPECT_LT((measured->grid.origin.lps - scan.grid.origin.lps).norm(), 1e-9);
}

TEST(MeasuredBox, LeavesOutWhatALimbIsCutOffByAndKeepsMaskedAir) {
  const Volume limb = LimbInMaskedAir();
  ExpectBox(MeasuredBoxOf(limb), {0, 0, 0}, {23, 39, 23});
  ExpectBox(MeasuredBoxOf(Filled(limb, {4, 5, 6}, {4, 5, 6}, 0)), {0, 5, 0}, {31, 49, 35});
}

TEST(MeasuredBox, OfAScanThatWasMeasuredToItsSidesIsNoCopy) {
  const Scan scan{Noise({5, 6, 7})};
  EXPECT_EQ(&*Measured(scan), &scan);
  EXPECT_EQ(&*Measured(scan.volume), &scan.volume);
  const Scan filled{.volume = Filled(scan.volume, {0, 0, 1}, {0, 0, 0}, 7), .modality = "MR"};
  const OwnOrLent<Scan> measured = Measured(filled);
  EXPECT_EQ(measured->volume.values, scan.volume.values);
  EXPECT_EQ(measured->modality, "MR");
}

// No spline could be put through it.
TEST(MeasuredBox, IsNeverASinglePlane) {
  const Volume filled = Filled(Noise({9, 10, 1}), {0, 0, 3}, {0, 0, 2}, 0);
  ExpectBox(MeasuredBoxOf(filled), {0, 0, 0}, {8, 9, 5});
}

TEST(MeasuredBox, IsAllOfAScanOfOneValue) {
  ExpectBox(MeasuredBoxOf(Volume(ObliqueGrid({3, 4, 5}), 7)), {0, 0, 0}, {2, 3, 4});
}

}  // namespace
}  // namespace kvx
