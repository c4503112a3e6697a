// Stripes of a known gain are found and taken out; anatomy, noise and CT are left as they are.
#include "pipeline/scans/slice_alternation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

// A limb of two tissues that ends inside the view, its border slanted to the slices, in air; noise.
Scan Limb() {
  Scan scan;
  scan.volume = Volume(testing_support::ObliqueGrid({36, 32, 40}));
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0, 4);
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    const Eigen::Vector3d at = scan.volume.grid.Ijk(v).cast<double>();
    const double from_axis = std::hypot(at.x() - 18 - 0.1 * at.z(), at.y() - 16);
    const float tissue = from_axis > 13 ? 0.0f : from_axis > 6 ? 90.0f : 160.0f;
    scan.volume.values[v] = std::abs(tissue + noise(random));
  }
  return scan;
}

Scan Striped(Scan scan, int axis, float gain_of_odd) {
  for (size_t v = 0; v < scan.volume.values.size(); ++v)
    if (scan.volume.grid.Ijk(v)[axis] % 2) scan.volume.values[v] *= gain_of_odd;
  return scan;
}

TEST(SliceAlternation, IsFoundWithItsAxisAndGain) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto found = FindSliceAlternation(Striped(Limb(), axis, 0.8f).volume);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->axis, axis);
    EXPECT_NEAR(found->log_gain, 0.5 * std::log(1 / 0.8), 0.01);
  }
  EXPECT_NEAR(FindSliceAlternation(Striped(Limb(), 1, 1.25f).volume)->log_gain, 0.5 * std::log(0.8), 0.01);
}

// Of slices of many voxels only every so many-th row and column is looked at.
TEST(SliceAlternation, IsFoundInLargeSlicesToo) {
  Scan scan;
  scan.volume = Volume(testing_support::ObliqueGrid({300, 260, 12}));
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0, 8);
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    const Eigen::Vector3i p = scan.volume.grid.Ijk(v);
    const bool limb = std::hypot(p.x() - 150.0 - p.z(), p.y() - 130.0) < 90;
    scan.volume.values[v] = std::abs((limb ? 160.0f : 0.0f) + noise(random));
  }
  EXPECT_FALSE(FindSliceAlternation(scan.volume));
  const auto found = FindSliceAlternation(Striped(scan, 2, 0.9f).volume);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->axis, 2);
  EXPECT_NEAR(found->log_gain, 0.5 * std::log(1 / 0.9), 0.002);
}

TEST(SliceAlternation, IsNotWhatAnatomyAndNoiseMake) { EXPECT_FALSE(FindSliceAlternation(Limb().volume)); }

TEST(EvenSlices, GivesBackTheScanButForItsScale) {
  const Scan limb = Limb();
  Scan striped = Striped(limb, 2, 0.8f);
  EXPECT_NEAR(EvenSlices(striped), 0.25, 0.03);
  const double scale = std::sqrt(0.8);
  double most = 0;
  for (size_t v = 0; v < limb.volume.values.size(); ++v)
    most = std::max(most, std::abs(striped.volume.values[v] / scale - limb.volume.values[v]));
  EXPECT_LT(most, 0.02 * 160);
}

TEST(EvenSlices, SingleVoxelsFarFromAllOthersDoNotMatter) {
  for (const float stray : {-1000.0f, 65535.0f}) {
    Scan striped = Striped(Limb(), 2, 0.8f);
    striped.volume.values[17] = stray;
    EXPECT_NEAR(EvenSlices(striped), 0.25, 0.03) << stray;
  }
}

TEST(EvenSlices, LeavesScansThatNeedNothingAsTheyAre) {
  Scan limb = Limb();
  EXPECT_EQ(EvenSlices(limb), 0);
  EXPECT_EQ(limb.volume.values, Limb().volume.values);
  Scan ct = Striped(Limb(), 2, 0.8f);
  ct.modality = "CT";
  const auto before = ct.volume.values;
  EXPECT_EQ(EvenSlices(ct), 0) << "Hounsfield units mean something";
  EXPECT_EQ(ct.volume.values, before);
}

TEST(EvenSlices, StandsThinVolumes) {
  Scan slice;
  slice.volume = Volume(testing_support::ObliqueGrid({30, 30, 1}), 5.0f);
  slice.volume.values[7] = 90;
  EXPECT_EQ(EvenSlices(slice), 0);
}

}  // namespace
}  // namespace kvx
