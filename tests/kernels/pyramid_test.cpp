// Smoothing and halving keep linear ramps; the kernels agree with their twins.
#include "kernels/pyramid.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/reference/pyramid.h"
#include "tests/support/fixtures.h"
#include "tests/support/plain_grid.h"
#include "tests/support/waves.h"

namespace kvx {
namespace {
using namespace testing_support;

Volume NoiseOn(const Grid& grid) {
  Volume out(grid);
  std::mt19937 random(3);
  for (float& value : out.values) value = float(random() % 1000) * 0.1f;
  return out;
}

void ExpectNear(const std::vector<float>& a, const std::vector<float>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t v = 0; v < a.size(); ++v) ASSERT_NEAR(a[v], b[v], tolerance) << "voxel " << v;
}

TEST(Pyramid, ARampKeepsItsPlaceInTheWorld) {
  const LinearRamp ramp;
  const Grid grid = ObliqueGrid({16, 12, 10});
  const Pyramid pyramid(SharedBackend());
  ExpectNear(pyramid.Halved(ramp.On(grid)).values, ramp.On(Coarsened(grid, 2)).values, 1e-3);
  const Volume smoothed = pyramid.Smoothed(ramp.On(grid)), exact = ramp.On(grid);
  for (int k = 1; k < 9; ++k) {
    for (int j = 1; j < 11; ++j) {
      for (int i = 1; i < 15; ++i) ASSERT_NEAR(smoothed(i, j, k), exact(i, j, k), 1e-3);
    }
  }
}

TEST(Pyramid, SmoothingLeavesThreeQuartersOfAWaveOfFourVoxels) {
  const Volume wave = Wave(PlainGrid({24, 4, 4}, {1, 1, 1}, {0, 0, 0}), {kPi / 2, 0, 0});
  const Volume smoothed = Pyramid(SharedBackend()).Smoothed(wave);
  for (int i = 1; i < 23; ++i) ASSERT_NEAR(smoothed(i, 2, 1) - 100, 0.75f * (wave(i, 2, 1) - 100), 1e-3);
  // Of neighbours two voxels away a half is left.
  const Volume farther = Pyramid(SharedBackend()).Smoothed(wave, {2, 1, 3});
  for (int i = 2; i < 22; ++i) ASSERT_NEAR(farther(i, 2, 1) - 100, 0.5f * (wave(i, 2, 1) - 100), 1e-3);
}

TEST(Pyramid, AgreesWithItsTwinOnOddSizes) {
  const Volume noise = NoiseOn(ObliqueGrid({17, 13, 11}));
  const Pyramid pyramid(SharedBackend());
  ExpectNear(pyramid.Smoothed(noise).values, reference::Smoothed(noise).values, 1e-4);
  ExpectNear(pyramid.Smoothed(noise, {1, 2, 4}).values, reference::Smoothed(noise, {1, 2, 4}).values, 1e-4);
  ExpectNear(pyramid.Halved(noise).values, reference::Halved(noise).values, 1e-4);
}

}  // namespace
}  // namespace kvx
