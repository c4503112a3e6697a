// The spline against its closed forms.
#include "core/voxels/cubic_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fixtures.h"
#include "tests/support/plain_grid.h"
#include "tests/support/waves.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(CubicSpline, RunsThroughTheVoxels) {
  Volume noise(ObliqueGrid({7, 2, 9}));
  std::mt19937 random(3);
  for (float& value : noise.values) value = float(random() % 1000);
  const Volume spline = SplineCoefficients(noise);
  for (size_t v = 0; v < noise.values.size(); ++v)
    ASSERT_NEAR(SampleSpline(spline, PointVox{noise.grid.Ijk(v).cast<double>()}), noise.values[v], 0.01);
}

// Unser 1999: of an impulse, -6 z / (1 - z^2) z^|n|, z = sqrt(3) - 2.
TEST(CubicSpline, AnswersAnImpulseByItsClosedForm) {
  const double pole = std::sqrt(3.0) - 2;
  const auto line = [&](int n) { return -6 * pole / (1 - pole * pole) * std::pow(pole, std::abs(n)); };
  Volume impulse(PlainGrid({41, 41, 41}, {1, 1, 1}, {0, 0, 0}));
  impulse(20, 20, 20) = 1;
  const Volume spline = SplineCoefficients(impulse);
  for (int n = -4; n <= 4; ++n) {
    EXPECT_NEAR(spline(20 + n, 20, 20), line(n) * line(0) * line(0), 1e-6);
    EXPECT_NEAR(spline(20, 20 + n, 21), line(0) * line(n) * line(1), 1e-6);
  }
}

// Where a linear reader keeps cos(pi / 4) of it.
TEST(CubicSpline, KeepsAWaveOfFourVoxelsHalfWayBetweenThem) {
  const double per_mm = kPi / 2;
  const Volume wave = Wave(PlainGrid({41, 6, 6}, {1, 1, 1}, {0, 0, 0}), {per_mm, 0, 0});
  const Volume spline = SplineCoefficients(wave);
  for (int i = 10; i < 30; ++i)
    EXPECT_NEAR(SampleSpline(spline, PointVox{{i + 0.5, 3.3, 2.7}}), 100 + 50 * std::cos(per_mm * (i + 0.5)),
                1.0);
}

TEST(CubicSpline, StaysAtItsMirrorAndEndsWithTheVoxels) {
  Volume line(PlainGrid({5, 3, 3}, {1, 1, 1}, {0, 0, 0}));
  for (size_t v = 0; v < line.values.size(); ++v) line.values[v] = float(10 * line.grid.Ijk(v).x());
  const SplineTaps first(0, 5), last(4, 5);
  const Volume spline = SplineCoefficients(line);
  double slopes[2] = {};
  for (int n = 0; n < 4; ++n) {
    slopes[0] += first.slope[n] * spline(first.at[n], 1, 1);
    slopes[1] += last.slope[n] * spline(last.at[n], 1, 1);
  }
  EXPECT_NEAR(slopes[0], 0, 1e-4);
  EXPECT_NEAR(slopes[1], 0, 1e-4);
  EXPECT_EQ(SampleSpline(spline, PointVox{{4.001, 1, 1}}, -7), -7);
  EXPECT_EQ(SampleSpline(spline, PointVox{{2, -0.001, 1}}, -7), -7);
}

}  // namespace
}  // namespace kvx
