// Sums of classes that can be written down.
#include "pipeline/bones/search/correlation_ratio.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr float kSamples = 500;

// A class whose samples all have this grey, a part of them in the scan's air.
CorrelationSums Greys(float grey) {
  CorrelationSums sums;
  sums.count = kSamples, sums.s = kSamples * grey, sums.ss = kSamples * grey * grey;
  return sums;
}
CorrelationSums InAir(float part) { return Greys(part); }

TEST(CorrelationRatio, EvenClassesInTheirPlacesTellAll) {
  CorrelationRatio ratio;
  ratio.Add(Greys(1), InAir(0), false);
  ratio.Add(Greys(-0.3f), InAir(0), false);
  ratio.Add(Greys(-2), InAir(1), true);
  EXPECT_GT(ratio.Value(), 0.98);
  EXPECT_EQ(ratio.Count(), 3 * kSamples);
}

// total: 1000 * (1 + 0.02 + 0.5), within: 1000 * (0.02 + 1)
TEST(CorrelationRatio, GreysThatTellAllTellLittleWhereTissueLiesInAir) {
  CorrelationRatio ratio;
  ratio.Add(Greys(1), InAir(1), false);
  ratio.Add(Greys(-1), InAir(0), true);
  EXPECT_NEAR(ratio.Value(), 1 - 1.02 / 1.52 * 999 / 998, 1e-6);
}

// Half of the tissue and half of the air in the scan's air: greys of variance 1 between classes, and
// silhouettes that agree as often as by chance.
TEST(CorrelationRatio, SilhouettesByChanceCountAsUnexplained) {
  CorrelationRatio ratio;
  ratio.Add(Greys(1), InAir(0.5f), false);
  ratio.Add(Greys(-1), InAir(0.5f), true);
  // total: 1000 * (1 + 0.02 + 0.5), within: 1000 * (0.02 + 0.5)
  EXPECT_NEAR(ratio.Value(), 1 - 0.52 / 1.52 * 999 / 998, 1e-6);
}

TEST(CorrelationRatio, AirOfOneImageAloneIsUnexplainedButLeavesTheGreysTheirSay) {
  CorrelationRatio without, with;
  without.Add(Greys(1), InAir(0), false);
  without.Add(Greys(0), InAir(0), false);
  with.Add(Greys(1), InAir(0), false);
  with.Add(Greys(0), InAir(0), true);  // none in the scan
  EXPECT_GT(with.Value(), 0);
  EXPECT_LT(with.Value(), without.Value());
  CorrelationRatio flat;
  flat.Add(Greys(0), InAir(0), false);
  flat.Add(Greys(0), InAir(0), false);
  EXPECT_EQ(flat.Value(), 0);
}

}  // namespace
}  // namespace kvx
