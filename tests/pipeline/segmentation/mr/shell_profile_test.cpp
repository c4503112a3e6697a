// Profiles from an integral over a blurred shell, not from the model's own formula.
#include "pipeline/segmentation/mr/shell_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr double kBlur = 0.6, kThickness = 0.7;

// Other tissue ends in air.
double Tissue(double place, double outer, double air = INFINITY) {
  if (place > air) return 0;
  if (place > outer) return 0.55;
  return place > outer - kThickness ? 0.1 : 0.95;
}

template <class Show>
ShellProfile::Samples Blurred(const Show& show) {
  constexpr double kStep = 0.002;
  ShellProfile::Samples samples{};
  for (int n = 0; n < ShellProfile::kSamples; ++n) {
    double sum = 0, weights = 0;
    for (double d = -4 * kBlur; d <= 4 * kBlur; d += kStep) {
      const double weight = std::exp(-0.5 * d * d / (kBlur * kBlur));
      sum += weight * show(ShellProfile::PlaceOf(n) + d), weights += weight;
    }
    samples[size_t(n)] = float(sum / weights);
  }
  return samples;
}

ShellProfile::Samples BlurredShell(double outer) {
  return Blurred([&](double place) { return Tissue(place, outer); });
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

TEST(ShellProfile, AWrongThicknessExplainsLess) {
  const ShellProfile::Samples samples = BlurredShell(0);
  const auto least = [&](double thickness) {
    return std::ranges::min(ShellProfile(kBlur, thickness).MisfitsOf(samples));
  };
  EXPECT_LT(least(kThickness), 0.3 * least(0.3));
  EXPECT_LT(least(kThickness), 0.3 * least(1.4));
}

// Skin a voxel thick: what is known to be air is not taken for tissue as dark as the shell.
TEST(ShellProfile, ExplainsAShellUnderThinSkin) {
  constexpr double kSkin = 0.8;
  const ShellProfile model(kBlur, kThickness);
  for (const int at : {6, 10, 12}) {
    const double outer = ShellProfile::OffsetOf(at), skin = outer + kSkin;
    const auto samples = Blurred([&](double place) { return Tissue(place, outer, skin); });
    const auto air = Blurred([&](double place) { return place > skin ? 1.0 : 0.0; });
    const ShellProfile::Misfits known = model.MisfitsOf(samples, air), unknown = model.MisfitsOf(samples);
    EXPECT_EQ(std::ranges::min_element(known) - known.begin(), at);
    EXPECT_LT(known[size_t(at)], 1e-4);
    EXPECT_GT(unknown[size_t(at)], 1e-3);
  }
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
