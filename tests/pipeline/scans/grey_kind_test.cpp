// Hounsfield units, magnitudes and the zero of greys, of images whose histograms are known.
#include "pipeline/scans/grey_kind.h"

#include <gtest/gtest.h>

#include "tests/support/mr_greys.h"

namespace kvx {
namespace {
using namespace testing_support;

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

TEST(IsHounsfield, NothingIsLighterThanAir) {
  EXPECT_FALSE(IsHounsfield(Mr(2, -32768), ""));
  EXPECT_TRUE(ContradictsCt(Mr(2, -32768)));
}

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

TEST(IsMagnitude, IsNoMatterOfSingleVoxels) {
  Volume scan = Mr();
  EXPECT_TRUE(IsMagnitude(scan));
  scan.values[17] = -1000;
  EXPECT_TRUE(IsMagnitude(scan));
  for (size_t v = 0; v < scan.values.size(); v += 50) scan.values[v] = -1000;
  EXPECT_FALSE(IsMagnitude(scan));
}

TEST(IsMagnitude, NothingButZeroIsNone) {
  Volume scan = Mr();
  std::ranges::fill(scan.values, 0.0f);
  EXPECT_FALSE(IsMagnitude(scan));
  scan.values[17] = 1;
  EXPECT_TRUE(IsMagnitude(scan));
  scan.values[17] = -1;
  EXPECT_FALSE(IsMagnitude(scan));
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
