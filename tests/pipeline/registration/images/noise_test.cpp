// Noise of known size on a ramp is found; the ramp itself is not mistaken for noise.
#include "pipeline/registration/images/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fixtures.h"
#include "tests/support/shared_noise.h"

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
  const Volume shared = RampWithSharedNoise(1);
  EXPECT_NEAR(NoiseSigma(shared, Mask(shared.grid, 1)), 3 / std::sqrt(8.0), 0.1);
}

// Noise weighted 1, 2, 1 along an axis, as linear interpolation between voxels weights it: differences over
// two voxels have 2.5 times the variance of those between neighbours, by which 1.8 in a row share.
TEST(VoxelsSharingNoise, AreHalfWayToTheCubeOfThoseInARow) {
  EXPECT_NEAR(VoxelsSharingNoise(RampWithSharedNoise(2)), std::pow(1.8, 1.5), 0.15);
}

TEST(VoxelsSharingNoise, AreOneWhereEachIsMeasuredForItself) {
  EXPECT_EQ(VoxelsSharingNoise(NoisyRamp({32, 32, 32}, 5)), 1);
  EXPECT_EQ(VoxelsSharingNoise(RampWithSharedNoise(2, 2)), 1) << "interpolated within slices alone";
}

// A ball's smooth shading, whose differences over two voxels are larger too.
TEST(VoxelsSharingNoise, AreOneOfSmoothAnatomyWithoutNoise) {
  Volume smooth(ObliqueGrid({32, 32, 32}));
  for (size_t v = 0; v < smooth.values.size(); ++v) {
    const Eigen::Vector3d from = smooth.grid.Ijk(v).cast<double>() - Eigen::Vector3d::Constant(16);
    smooth.values[v] = float(100 * std::exp(-from.squaredNorm() / 128));
  }
  EXPECT_EQ(VoxelsSharingNoise(smooth), 1);
}

}  // namespace
}  // namespace kvx
