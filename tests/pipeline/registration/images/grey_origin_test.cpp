// Where greys begin, of images whose histograms are known.
#include "pipeline/registration/images/grey_origin.h"

#include <gtest/gtest.h>

#include "tests/support/mr_greys.h"

namespace kvx {
namespace {
using namespace testing_support;

float OriginOf(const Volume& volume) { return GreyOriginOf(volume, {}, "MR"); }

TEST(GreyOrigin, IsTheDarkestOfShiftedGreys) {
  EXPECT_EQ(OriginOf(Mr()), 0);
  EXPECT_NEAR(OriginOf(Mr(1, 20)), 20, 0.1);
  EXPECT_NEAR(OriginOf(Mr(2, -128)), -128, 0.1);
  EXPECT_NEAR(OriginOf(Mr(1, 32768)), 32768, 0.1);
  Volume undershot = Mr();
  for (size_t v = 0; v < undershot.values.size(); v += 2000) undershot.values[v] = -1200;
  EXPECT_EQ(OriginOf(undershot), 0) << "strays";
}

TEST(GreyOrigin, OfHounsfieldUnitsIsWater) { EXPECT_EQ(GreyOriginOf(Mr(1, -1000), {}, "CT"), 0); }

TEST(GreyOrigin, IsWithoutWhatAProgramFilledUp) {
  Volume scan = Mr(1, 100);
  Mask filled(scan.grid);
  for (size_t v = 0; v < scan.values.size(); v += 7) scan.values[v] = 0, filled.values[v] = 1;
  EXPECT_EQ(OriginOf(scan), 0);
  EXPECT_NEAR(GreyOriginOf(scan, filled, "MR"), 100, 0.1);
}

TEST(FromOrigin, LetsGreysBeginAtZero) {
  const Volume scan = Mr(1, 100), from_zero = FromOrigin(scan, OriginOf(scan));
  EXPECT_EQ(from_zero.values[1], scan.values[1] - OriginOf(scan));
  EXPECT_EQ(OriginOf(from_zero), 0);
}

}  // namespace
}  // namespace kvx
