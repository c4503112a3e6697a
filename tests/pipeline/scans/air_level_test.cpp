// Air, of images whose histograms are known.
#include "pipeline/scans/air_level.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/mr_greys.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(FindAirLevel, AFewVoxelsFarBelowZeroDoNotHideTheAir) {
  Volume scan = Mr();
  std::fill_n(scan.values.begin(), 8, -1024.0f);
  for (const char* modality : {"", "MR"}) {
    const auto level = FindAirLevel(scan, modality);
    ASSERT_TRUE(level.has_value());
    EXPECT_NEAR(level->tissue, 100, 3);
  }
}

TEST(FindAirLevel, OneVoxelFarAboveAllOthersChangesNothing) {
  const AirLevel level = *FindAirLevel(Mr(), "MR");
  const double threshold = OtsuThreshold(Mr().values);
  for (const float stray : {32767.0f, 1e6f, -1e9f}) {
    Volume scan = Mr();
    scan.values[17] = stray;
    const auto found = FindAirLevel(scan, "MR");
    ASSERT_TRUE(found.has_value()) << stray;
    EXPECT_NEAR(found->air, level.air, 0.5) << stray;
    EXPECT_NEAR(found->tissue, level.tissue, 0.5) << stray;
    EXPECT_NEAR(found->spread, level.spread, 0.5) << stray;
    EXPECT_NEAR(OtsuThreshold(scan.values), threshold, 5) << stray;
  }
}

// Air, tissue, and metal as one voxel in 25.
TEST(FindAirLevel, MetalInACtIsNoClassOfItsOwn) {
  for (const float metal : {3071.0f, 20000.0f}) {
    Volume ct(ObliqueGrid({40, 40, 40}), -1000.0f);
    for (size_t v = 0; v < ct.values.size(); ++v) {
      if (v % 5 < 2) ct.values[v] = v % 25 == 0 ? metal : float(20 + v % 41);
      if (v % 500 == 1) ct.values[v] = -80;  // fat
    }
    for (const char* modality : {"", "CT"}) {
      const auto level = FindAirLevel(ct, modality);
      ASSERT_TRUE(level.has_value());
      EXPECT_EQ(level->air, -1000);
      EXPECT_NEAR(level->tissue, 40, 5);
    }
  }
}

TEST(FindAirLevel, GreysMayBeShifted) {
  for (const float shift : {-128.0f, 0.0f, 1000.0f, 32768.0f}) {
    const auto level = FindAirLevel(Mr(1, shift), "");
    ASSERT_TRUE(level.has_value()) << shift;
    EXPECT_NEAR(level->air, shift + 7, 4) << "the lower half of the darker class";
    EXPECT_NEAR(level->tissue, shift + 100, 3);
  }
}

TEST(FindAirLevel, FatAndMuscleWithoutAirHaveNone) {
  Volume inside(ObliqueGrid({20, 20, 20}));
  std::mt19937 random(4);
  std::normal_distribution<float> unit;
  for (size_t v = 0; v < inside.values.size(); ++v)
    inside.values[v] = (v % 2 ? 80.0f : 200.0f) + 8 * unit(random);
  EXPECT_FALSE(FindAirLevel(inside, "").has_value());
}

}  // namespace
}  // namespace kvx
