// Noise of known size on a ramp is found; the ramp itself is not mistaken for noise.
#include "pipeline/registration/images/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// With noise of sigma 3.
Volume NoisyRamp(const Eigen::Vector3i& size, unsigned seed) {
  Volume volume = LinearRamp{}.On(ObliqueGrid(size));
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, 3);
  for (float& value : volume.values) value += noise(random);
  return volume;
}

TEST(NoiseSigma, FindsPlantedNoiseOnARamp) {
  const Volume volume = NoisyRamp({32, 32, 32}, 2);
  EXPECT_NEAR(NoiseSigma(volume, Mask(volume.grid, 1)), 3.0, 0.15);
  EXPECT_NEAR(NoiseSigma(volume), 3.0, 0.25);
}

// Of more than a million voxels some rows are enough.
TEST(NoiseSigma, FindsItInALargeVolume) {
  const Volume volume = NoisyRamp({110, 100, 100}, 4);
  EXPECT_NEAR(NoiseSigma(volume, Mask(volume.grid, 1)), 3.0, 0.05);
}

TEST(NoiseSigma, ARampAloneHasNextToNone) {
  const Volume volume = LinearRamp{}.On(ObliqueGrid({32, 32, 32}));
  EXPECT_LT(NoiseSigma(volume), 0.05);
}

// The mean of two neighbours along every axis: the noise's variance is an eighth, and neighbours share half.
TEST(NoiseSigma, IsTheWholeNoiseWhereNeighboursShareIt) {
  Volume white(ObliqueGrid({33, 33, 33}));
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 3);
  for (float& value : white.values) value = noise(random);
  Volume shared = LinearRamp{}.On(ObliqueGrid({32, 32, 32}));
  for (size_t v = 0; v < shared.values.size(); ++v) {
    const Eigen::Vector3i p = shared.grid.Ijk(v);
    for (int c = 0; c < 8; ++c)
      shared.values[v] += white(p.x() + (c & 1), p.y() + (c >> 1 & 1), p.z() + (c >> 2)) / 8;
  }
  EXPECT_NEAR(NoiseSigma(shared, Mask(shared.grid, 1)), 3 / std::sqrt(8.0), 0.1);
}

}  // namespace
}  // namespace kvx
