// Air, Hounsfield units and the zero of greys, of images whose histograms are known.
#include "pipeline/scans/air_level.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Half air of 10 +- 4, half tissue of 100 +- 10, as a scanner stores them; times `gain`, plus `shift`.
Volume Mr(float gain = 1, float shift = 0) {
  Volume scan(ObliqueGrid({40, 40, 40}));
  std::mt19937 random(3);
  std::normal_distribution<float> unit;
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const float grey = v % 2 ? 10 + 4 * unit(random) : 100 + 10 * unit(random);
    scan.values[v] = shift + gain * std::max(0.0f, grey);
  }
  return scan;
}

TEST(IsHounsfield, IsTheFilesWordOrAShareOfAir) {
  Volume ct(ObliqueGrid({10, 10, 10}), 40.0f);
  std::fill_n(ct.values.begin(), 100, -1000.0f);
  ct.values[100] = -80;  // fat
  EXPECT_TRUE(IsHounsfield(ct, ""));
  EXPECT_FALSE(IsHounsfield(ct, "MR"));
  EXPECT_TRUE(IsHounsfield(Mr(), "CT"));
  EXPECT_FALSE(IsHounsfield(Mr(), ""));
}

TEST(IsHounsfield, AFewVoxelsFarBelowZeroAreNoAir) {
  Volume undershot = Mr(100);
  for (size_t v = 0; v < undershot.values.size(); v += 200) undershot.values[v] = -1200;
  EXPECT_FALSE(IsHounsfield(undershot, ""));
}

TEST(IsHounsfield, AFillingBesideTissueWithoutFatIsNoAir) {
  Volume filled = Mr();
  std::fill_n(filled.values.begin(), 20000, -1000.0f);
  EXPECT_FALSE(IsHounsfield(filled, ""));
}

TEST(IsHounsfield, TissueIsNoDenserThanBone) { EXPECT_FALSE(IsHounsfield(Mr(100, -3000), "")); }

// As CT is stored: 1024 is added to Hounsfield units, and a rescale takes it off again.
TEST(ContradictsCt, IsSaidOfGreysWithoutAVoxelOfFat) {
  Volume ct(ObliqueGrid({20, 20, 20}), 40.0f);
  for (size_t v = 0; v < ct.values.size(); v += 100) ct.values[v] = -80;  // fat, inside the body
  EXPECT_FALSE(ContradictsCt(ct));
  for (size_t v = 0; v < ct.values.size(); v += 3) ct.values[v] = -1000;
  EXPECT_FALSE(ContradictsCt(ct));
  for (float& value : ct.values) value += 1024;
  EXPECT_TRUE(ContradictsCt(ct));
  std::fill_n(ct.values.begin(), 4, -2000.0f);  // of 8000: no thousandth
  EXPECT_TRUE(ContradictsCt(ct));
}

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

TEST(IsMagnitude, IsNoMatterOfSingleVoxels) {
  Volume scan = Mr();
  EXPECT_TRUE(IsMagnitude(scan));
  scan.values[17] = -1000;
  EXPECT_TRUE(IsMagnitude(scan));
  for (size_t v = 0; v < scan.values.size(); v += 50) scan.values[v] = -1000;
  EXPECT_FALSE(IsMagnitude(scan));
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

TEST(ZeroLevel, IsZeroUnlessAToolHasShiftedAllGreys) {
  EXPECT_EQ(ZeroLevelOf(Mr()), 0);
  EXPECT_EQ(ZeroLevelOf(Mr(100)), 0);
  EXPECT_NEAR(ZeroLevelOf(Mr(1, -128)), -128, 1e-3);
  EXPECT_NEAR(ZeroLevelOf(Mr(1, 1000)), 1000, 1e-3);
  Volume undershot = Mr(100);
  for (size_t v = 0; v < undershot.values.size(); v += 2000) undershot.values[v] = -1200;
  EXPECT_EQ(ZeroLevelOf(undershot), 0);
}

TEST(ZeroInPlaceOf, IsSaidOfNoValueThatAirOrTissueMayHave) {
  Volume masked = Mr();  // tissue alone, of few greys
  for (size_t v = 0; v < masked.values.size(); ++v) masked.values[v] = v % 2 ? 0 : 100 + float(v / 2 % 2);
  EXPECT_FALSE(ZeroInPlaceOf(0, masked)) << "air that a program masked";
  EXPECT_FALSE(ZeroInPlaceOf(100, masked)) << "a corner of tissue";
  EXPECT_FALSE(ZeroInPlaceOf(-1, Mr())) << "a spline's undershoot";
  EXPECT_FALSE(ZeroInPlaceOf(-200, Mr(1, -128))) << "among signed greys";
  EXPECT_FALSE(ZeroInPlaceOf(255, Mr())) << "bright tissue that was clipped";
  EXPECT_FALSE(ZeroInPlaceOf(0, Volume(masked.grid))) << "nothing but one value";
  EXPECT_FALSE(ZeroInPlaceOf(1, Volume(masked.grid))) << "beside one value";
}

TEST(ZeroInPlaceOf, IsTheZeroLevelOfTheOthers) {
  for (const float filling : {-1000.0f, -32768.0f, 9999.0f, 65535.0f}) {
    for (const float shift : {0.0f, -128.0f, 1000.0f}) {
      if (filling == -1000.0f && shift == -128.0f) continue;
      Volume scan = Mr(1, shift);
      std::fill_n(scan.values.begin(), 20000, filling);
      const auto zero = ZeroInPlaceOf(filling, scan);
      ASSERT_TRUE(zero.has_value()) << filling << " among greys shifted by " << shift;
      EXPECT_NEAR(*zero, shift, 1) << filling;
    }
  }
}

}  // namespace
}  // namespace kvx
