// Mutual information against closed forms, and its gradient against finite differences.
#include "core/mutual_information.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
  const MutualInformation mi =
      EstimateMutualInformation(t, s, w, kBinRange, kBinRange, MutualInformationGradient::kYes);
  EXPECT_EQ(mi.normalised, 1);
  EXPECT_EQ(mi.slope, std::vector<double>(3, 0.0));
}

// `spread`: of the scan's values; small and large ones make either image the one with the smaller entropy.
void CheckGradient(double spread) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  std::vector<float> t, s, w;
  for (int n = 0; n < 300; ++n) {
    t.push_back(float(11 + 3 * noise(random)));
    s.push_back(float(11 + spread * (std::sin(double(t.back())) + 0.3 * noise(random))));
    s.back() = std::floor(s.back()) +
               std::clamp(s.back() - std::floor(s.back()), 0.01f, 0.99f);  // away from bin centres
    w.push_back(n % 5 == 0 ? 0.5f : 1.0f);
  }
  const auto at = [&] { return EstimateMutualInformation(t, s, w, kBinRange, kBinRange).normalised; };
  const std::vector<double> slope =
      EstimateMutualInformation(t, s, w, kBinRange, kBinRange, MutualInformationGradient::kYes).slope;
  constexpr float kStep = 1.0f / 1024;
  for (size_t n = 0; n < s.size(); n += 11) {
    const float kept = s[n];
    s[n] = kept + kStep;
    const double above = at();
    s[n] = kept - kStep;
    const double below = at();
    s[n] = kept;
    EXPECT_NEAR((above - below) / (2 * kStep), slope[n], 1e-5 + 0.01 * std::abs(slope[n])) << n;
  }
}

TEST(MutualInformation, GradientAgreesWithFiniteDifferences) {
  CheckGradient(0.7);
  CheckGradient(6);
}

// Values beyond the range are clamped, so that a little more or less of them changes nothing.
TEST(MutualInformation, DoesNotPullAtValuesBeyondTheRange) {
  std::vector<float> t, s;
  for (int n = 0; n < 60; ++n) t.push_back(float(n % 6)), s.push_back(0.8f * float(n % 6) + 0.5f);
  s[0] = -3, s[1] = kBinRange.high + 3;
  const MutualInformation mi = EstimateMutualInformation(t, s, std::vector<float>(t.size(), 1), kBinRange,
                                                         kBinRange, MutualInformationGradient::kYes);
  EXPECT_EQ(mi.slope[0], 0);
  EXPECT_EQ(mi.slope[1], 0);
  EXPECT_NE(mi.slope[2], 0);
}

}  // namespace
}  // namespace kvx
