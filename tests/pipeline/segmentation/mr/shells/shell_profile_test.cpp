// Profiles from an integral over a blurred shell, not from the model's own formula.
#include "pipeline/segmentation/mr/shells/shell_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr double kBlur = 0.6, kThickness = 0.7;

double Tissue(double place, double outer) {
  if (place > outer) return 0.55;
  return place > outer - kThickness ? 0.1 : 0.95;
}

ShellProfile::Samples BlurredShell(double outer) {
  constexpr double kStep = 0.002;
  ShellProfile::Samples samples{};
  for (int n = 0; n < ShellProfile::kSamples; ++n) {
    double sum = 0, weights = 0;
    for (double d = -4 * kBlur; d <= 4 * kBlur; d += kStep) {
      const double weight = std::exp(-0.5 * d * d / (kBlur * kBlur));
      sum += weight * Tissue(ShellProfile::PlaceOf(n) + d, outer), weights += weight;
    }
    samples[size_t(n)] = float(sum / weights);
  }
  return samples;
}

TEST(ShellProfile, ExplainsAShellWhereItIs) {
  const ShellProfile model(kBlur, kThickness);
  for (const int at : {4, 10, 14}) {
    const ShellProfile::Misfits misfits = model.MisfitsOf(BlurredShell(ShellProfile::OffsetOf(at)));
    EXPECT_EQ(std::ranges::min_element(misfits) - misfits.begin(), at);
    EXPECT_LT(misfits[size_t(at)], 1e-4);
    EXPECT_GT(misfits[size_t(at) + 3], 1e-3);
    EXPECT_GT(misfits[size_t(at) - 3], 1e-3);
  }
}

TEST(ShellProfile, SamplesThatAreNoNumberHaveNoSay) {
  constexpr int kAt = 10;
  const ShellProfile model(kBlur, kThickness);
  const ShellProfile::Samples whole = BlurredShell(ShellProfile::OffsetOf(kAt));
  const auto place_of = [&](float beyond) {
    ShellProfile::Samples samples = whole;
    std::fill(samples.end() - 3, samples.end(), beyond);
    const ShellProfile::Misfits misfits = model.MisfitsOf(samples);
    return std::pair(std::ranges::min_element(misfits) - misfits.begin(), misfits);
  };
  EXPECT_NE(place_of(0.02f).first, kAt);  // air
  const auto [place, misfits] = place_of(NAN);
  EXPECT_EQ(place, kAt);
  EXPECT_LT(misfits[kAt], 1e-4);
  for (size_t n = 0; n < misfits.size(); ++n) EXPECT_LE(misfits[n], model.MisfitsOf(whole)[n] + 1e-6) << n;
}

TEST(ShellProfile, AWrongThicknessExplainsLess) {
  const ShellProfile::Samples samples = BlurredShell(0);
  const auto least = [&](double thickness) {
    return std::ranges::min(ShellProfile(kBlur, thickness).MisfitsOf(samples));
  };
  EXPECT_LT(least(kThickness), 0.3 * least(0.3));
  EXPECT_LT(least(kThickness), 0.3 * least(1.4));
}

// Across a long round bone of a radius, on a line through its axis.
ShellProfile::Samples BlurredRoundShell(double radius) {
  constexpr double kStep = 0.04;
  ShellProfile::Samples samples{};
  for (int n = 0; n < ShellProfile::kSamples; ++n) {
    const double from_axis = radius + ShellProfile::PlaceOf(n);
    double sum = 0, weights = 0;
    for (double x = -4 * kBlur; x <= 4 * kBlur; x += kStep) {
      for (double y = -4 * kBlur; y <= 4 * kBlur; y += kStep) {
        const double weight = std::exp(-0.5 * (x * x + y * y) / (kBlur * kBlur));
        sum += weight * Tissue(std::hypot(from_axis + x, y), radius), weights += weight;
      }
    }
    samples[size_t(n)] = float(sum / weights);
  }
  return samples;
}

TEST(ShellProfile, ExplainsAShellAroundAThinRoundBone) {
  constexpr double kRadius = 1.8;
  const ShellProfile::Samples samples = BlurredRoundShell(kRadius);
  const auto misfits = ShellProfile(kBlur, kThickness, kRadius).MisfitsOf(samples);
  const auto least = std::ranges::min_element(misfits);
  EXPECT_NEAR(ShellProfile::OffsetOf(int(least - misfits.begin())), 0, 1e-9);
  EXPECT_LT(*least, 1e-3);  // marrow is tied to its level
  EXPECT_LT(*least, 0.5 * std::ranges::min(ShellProfile(kBlur, kThickness).MisfitsOf(samples)));
}

TEST(ShellProfile, AWideRoundBoneLooksFlat) {
  const ShellProfile::Samples samples = BlurredShell(0);
  const auto flat = ShellProfile(kBlur, kThickness).MisfitsOf(samples);
  const auto wide = ShellProfile(kBlur, kThickness, 40).MisfitsOf(samples);
  for (size_t n = 0; n < flat.size(); ++n) EXPECT_NEAR(wide[n], flat[n], 0.002);
}

}  // namespace
}  // namespace kvx
