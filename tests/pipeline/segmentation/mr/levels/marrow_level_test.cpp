// Marks of a bone under a coil that fades along it, in closed form.
#include "pipeline/segmentation/mr/levels/marrow_level.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr double kLengthMm = 80;

double UnderCoil(double z_mm) { return 1000 - 8 * z_mm; }

// A shaft along z, 16 mm thick.
std::vector<LevelSample> Shaft(double length_mm = kLengthMm) {
  std::vector<LevelSample> samples;
  for (double z = 0; z <= length_mm; z += 4) {
    for (double x = -8; x <= 8; x += 4) {
      for (double y = -8; y <= 8; y += 4)
        samples.push_back({PointMm{Eigen::Vector3d(x, y, z)}, UnderCoil(z)});
    }
  }
  return samples;
}

PointMm OnAxis(double z_mm) { return PointMm{Eigen::Vector3d(0, 0, z_mm)}; }

TEST(MarrowLevel, IsTheSamplesWhereTheyAreAlike) {
  std::vector<LevelSample> even = Shaft();
  for (LevelSample& sample : even) sample.intensity = 700;
  for (const auto fit : {MarrowLevel::kMean, MarrowLevel::kPlane}) {
    const MarrowLevel level(even, fit);
    for (const double z : {-30.0, 0.0, 40.0, 80.0, 120.0}) EXPECT_NEAR(level.At(OnAxis(z)), 700, 1e-6);
  }
}

TEST(MarrowLevel, APlaneFollowsACoilThatFadesToTheEndOfAShaft) {
  const MarrowLevel plane(Shaft(), MarrowLevel::kPlane), mean(Shaft());
  for (const double z : {0.0, 40.0, 80.0}) EXPECT_NEAR(plane.At(OnAxis(z)) / UnderCoil(z), 1, 0.07) << z;
  EXPECT_GT(mean.At(OnAxis(kLengthMm)), 1.2 * UnderCoil(kLengthMm));
}

TEST(MarrowLevel, APlaneDoesNotGoOnForEver) {
  const MarrowLevel plane(Shaft(), MarrowLevel::kPlane);
  EXPECT_GT(plane.At(OnAxis(300)), 0.3 * UnderCoil(kLengthMm / 2));
  EXPECT_LT(plane.At(OnAxis(-300)), 1.7 * UnderCoil(kLengthMm / 2));
}

// As where strokes lie in a scan's noise about nothing.
TEST(MarrowLevel, ABoneDarkerThanNothingHasNoBrightPlane) {
  std::vector<LevelSample> samples = Shaft();
  for (LevelSample& sample : samples) sample.intensity *= -1;
  EXPECT_LT(MarrowLevel(samples, MarrowLevel::kPlane).At(OnAxis(40)), 0);
}

TEST(MarrowLevel, CortexIsNoPartOfIt) {
  std::vector<LevelSample> samples = Shaft();
  for (size_t n = 0; n < samples.size(); n += 5) samples[n].intensity *= 0.2;
  for (const auto fit : {MarrowLevel::kMean, MarrowLevel::kPlane})
    EXPECT_NEAR(MarrowLevel(samples, fit).At(OnAxis(40)), UnderCoil(40), 0.02 * UnderCoil(40));
}

TEST(MarrowLevel, WithoutSamplesThereIsNone) {
  const MarrowLevel none({}, MarrowLevel::kPlane);
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.At(OnAxis(0)), 0);
}

}  // namespace
}  // namespace kvx
