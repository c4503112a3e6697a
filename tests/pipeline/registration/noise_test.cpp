// Noise of known size on a ramp is found; the ramp itself is not mistaken for noise.
#include "pipeline/registration/noise.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(NoiseSigma, FindsPlantedNoiseOnARamp) {
  Volume volume = LinearRamp{}.On(ObliqueGrid({32, 32, 32}));
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 3);
  for (float& value : volume.values) value += noise(random);
  EXPECT_NEAR(NoiseSigma(volume, Mask(volume.grid, 1)), 3.0, 0.15);
  EXPECT_NEAR(NoiseSigma(volume), 3.0, 0.25);
}

TEST(NoiseSigma, ARampAloneHasNextToNone) {
  const Volume volume = LinearRamp{}.On(ObliqueGrid({32, 32, 32}));
  EXPECT_LT(NoiseSigma(volume), 0.05);
}

}  // namespace
}  // namespace kvx
