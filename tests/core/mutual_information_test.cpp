// Mutual information against closed forms.
#include "core/mutual_information.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace kvx {
namespace {

constexpr IntensityRange kBinRange{0, kMutualInformationBins - 1};  // bin centres at whole numbers

TEST(MutualInformation, IsZeroWhereEveryPairOccursEquallyOften) {
  std::vector<float> t, s;
  for (int a = 0; a < 10; ++a) {
    for (int b = 0; b < 7; ++b) t.push_back(1.3f * a), s.push_back(2.1f * b);
  }
  const MutualInformation mi =
      EstimateMutualInformation(t, s, std::vector<float>(t.size(), 1), kBinRange, kBinRange);
  EXPECT_NEAR(mi.nats, 0, 1e-12);
  EXPECT_NEAR(mi.normalised, 0, 1e-12);
}

TEST(MutualInformation, OfAnImageWithItselfOrItsNegativeIsItsEntropy) {
  std::vector<float> t, negative;
  for (int n = 0; n < 80; ++n) t.push_back(float(n % 8)), negative.push_back(float(20 - 2 * (n % 8)));
  const std::vector<float> one(t.size(), 1);
  for (const auto& s : {t, negative}) {
    const MutualInformation mi = EstimateMutualInformation(t, s, one, kBinRange, kBinRange);
    EXPECT_NEAR(mi.nats, std::log(8.0), 1e-12);
    EXPECT_NEAR(mi.smaller_entropy_nats, std::log(8.0), 1e-12);
    EXPECT_NEAR(mi.normalised, 1, 1e-12);
  }
}

TEST(MutualInformation, IgnoresSamplesWithoutWeight) {
  const std::vector<float> t{1, 2, 1, 2, 9}, s{3, 4, 3, 4, 3}, w{1, 1, 1, 1, 0};
  EXPECT_NEAR(EstimateMutualInformation(t, s, w, kBinRange, kBinRange).nats, std::log(2.0), 1e-12);
}

TEST(MutualInformation, AFlatImageMatches) {
  const std::vector<float> t{1, 2, 3}, s{4, 4, 4}, w{1, 1, 1};
  EXPECT_EQ(EstimateMutualInformation(t, s, w, kBinRange, kBinRange).normalised, 1);
}

// Values beyond the range are taken for its ends.
TEST(MutualInformation, ClampsValuesBeyondTheRange) {
  const std::vector<float> one(8, 1), t{0, 1, 2, 3, 0, 1, 2, 3};
  const std::vector<float> s{0, 5, 9, kBinRange.high, 0, 5, 9, kBinRange.high};
  std::vector<float> beyond = s;
  beyond[0] = -3, beyond[7] = kBinRange.high + 3;
  EXPECT_EQ(EstimateMutualInformation(t, beyond, one, kBinRange, kBinRange).nats,
            EstimateMutualInformation(t, s, one, kBinRange, kBinRange).nats);
}

}  // namespace
}  // namespace kvx
