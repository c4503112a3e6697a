// Waves in both images, which thick slices blur as is known on paper.
#include "pipeline/registration/images/shown_pair.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/plain_grid.h"
#include "tests/support/waves.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr int kSide = 32;
constexpr double kPerMm = 0.5;
// Of a wave in voxels of 1 mm, what slices of 4 mm leave.
const double kLeft = LeftByBox(kPerMm, 4) / LeftByBox(kPerMm, 1);

Grid Around0(const Eigen::Vector3d& spacing_mm) {
  const Eigen::Vector3d size = kSide * spacing_mm.cwiseInverse();
  return PlainGrid(size.cast<int>(), spacing_mm, -0.5 * (Eigen::Vector3d::Constant(kSide) - spacing_mm));
}
const Grid kCubes = Around0({1, 1, 1}), kSlices = Around0({1, 1, 4});

// A template that is body all over, and starts turned about x.
struct Pair {
  Volume nowhere{kCubes};
  LevelImages images{.beyond_coat_mm = nowhere,
                     .template_box = {},
                     .template_corners = {},
                     .scan_corners = {},
                     .body = Mask(kCubes, 1),
                     .body_distance_mm = Volume(kCubes),
                     .template_volume = Volume(kCubes),
                     .scan = Volume(kCubes),
                     .measured_scan = Volume(kCubes),
                     .times = Eigen::Vector3i::Ones()};
  std::vector<Eigen::Vector3f> start_mm;

  Pair(const Grid& scan_grid, double turn_rad) {
    images.measured_scan = Volume(scan_grid);
    const Eigen::AngleAxisd turn(turn_rad, Eigen::Vector3d::UnitX());
    for (size_t v = 0; v < nowhere.values.size(); ++v)
      start_mm.push_back((turn * kCubes.ToMm(PointVox{kCubes.Ijk(v).cast<double>()}).lps).cast<float>());
  }
  ShownPair Alike(const Grid& template_grid) const { return ShownAlike(images, template_grid, start_mm); }
};

// Every voxel well inside keeps `left` of what it differs from 100.
void ExpectLeft(const Volume& shown, const Volume& wave, double left) {
  for (size_t v = 0; v < wave.values.size(); ++v) {
    const Eigen::Vector3i p = wave.grid.Ijk(v);
    if (p.minCoeff() < 4 || p.maxCoeff() >= kSide - 4) continue;
    ASSERT_NEAR(shown.values[v] - 100, left * (wave.values[v] - 100), 0.6) << p.transpose();
  }
}

void ExpectAsTheyAre(Pair pair, const Grid& template_grid) {
  pair.images.template_volume = pair.images.scan = Wave(kCubes, {0, 0, kPerMm});
  const ShownPair shown = pair.Alike(template_grid);
  EXPECT_EQ(shown.template_volume.values, pair.images.template_volume.values);
  EXPECT_EQ(shown.scan.values, pair.images.scan.values);
}

TEST(ShownAlike, CubesAreShownAsTheyAre) { ExpectAsTheyAre(Pair(kCubes, 0.5), kCubes); }

TEST(ShownAlike, ATemplateOfCubesIsBlurredAsTheSlicesLieInIt) {
  for (const double turn_rad : {0.0, std::acos(0.0)}) {
    Pair pair(kSlices, turn_rad);
    // The direction in the template that comes to lie along the scan's z, and one that lies across it.
    const Eigen::Vector3d along(0, std::sin(turn_rad), std::cos(turn_rad)),
        across(0, std::cos(turn_rad), std::sin(turn_rad));
    pair.images.scan = Wave(kCubes, {0, 0, kPerMm});
    pair.images.template_volume = Wave(kCubes, kPerMm * along);
    ExpectLeft(pair.Alike(kCubes).template_volume, pair.images.template_volume, kLeft);
    pair.images.template_volume = Wave(kCubes, kPerMm * across);
    ExpectLeft(pair.Alike(kCubes).template_volume, pair.images.template_volume, 1);
    EXPECT_EQ(pair.Alike(kCubes).scan.values, pair.images.scan.values);
  }
}

TEST(ShownAlike, AScanOfCubesIsBlurredAsTheTemplatesSlicesLieInIt) {
  const double quarter_rad = std::acos(0.0);
  Pair pair(kCubes, quarter_rad);  // the template's z comes to lie along the scan's y
  pair.images.template_volume = Wave(kCubes, {0, 0, kPerMm});
  pair.images.scan = Wave(kCubes, {0, kPerMm, 0});
  ExpectLeft(pair.Alike(kSlices).scan, pair.images.scan, kLeft);
  EXPECT_EQ(pair.Alike(kSlices).template_volume.values, pair.images.template_volume.values);
  pair.images.scan = Wave(kCubes, {0, 0, kPerMm});
  ExpectLeft(pair.Alike(kSlices).scan, pair.images.scan, 1);
}

// Three taps an axis of weights 1/8, 3/4, 1/8: so many for a voxel of 1 mm to be as one of 2 mm.
TEST(ShownAlike, NoiseIsWhatTheTapsLeaveOfIt) {
  const double left = std::sqrt(0.75 * 0.75 + 2 * 0.125 * 0.125);
  Pair pair(Around0({2, 2, 2}), 0);
  const ShownPair shown = pair.Alike(kCubes);
  EXPECT_NEAR(shown.template_noise, left * left * left, 1e-6);
  EXPECT_EQ(shown.scan_noise, 1);
  EXPECT_NEAR(Pair(kCubes, 0).Alike(Around0({1, 1, 2})).scan_noise, left, 1e-6);
  EXPECT_EQ(Pair(kCubes, 0).Alike(kCubes).template_noise, 1);
}

TEST(ShownAlike, SlicesAlongEachOtherStayAsTheyAre) { ExpectAsTheyAre(Pair(kSlices, 0), kSlices); }

}  // namespace
}  // namespace kvx
