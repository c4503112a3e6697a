// A limb of which only the skin is bright, cut by the sides of the view, in air of one standard deviation.
#include <gtest/gtest.h>

#include <random>

#include "pipeline/skinning/dim_tissue.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

const AirLevel kAir{.air = 10, .spread = 4, .tissue = 100};

struct Scene {
  Grid grid = ObliqueGrid({110, 60, 24});
  Volume scan{grid};
  Mask body{grid};

  // `inside`, `ghost`: what the limb's middle and the air on its right are brighter than air by, in its
  // standard deviations.
  Scene(double inside, double ghost) {
    std::mt19937 random(3);
    std::normal_distribution<double> noise(kAir.air, kAir.spread);
    for (size_t v = 0; v < scan.values.size(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v);
      const double r = std::hypot(p.x() - 50.0, p.y() - 20.0);  // the skin passes the view's side at j = 0
      body.values[v] = r < 23 && r > 18;
      const bool bone = r < 4;  // as dark as air
      const double rise = body.values[v] ? 25 : r > 18 ? (p.x() > 80 ? ghost : 0) : bone ? 0 : inside;
      scan.values[v] = float(noise(random) + rise * kAir.spread);
    }
  }
  bool InBody(int i, int j) const { return WithDimTissue(scan, body, kAir)(i, j, 12); }
};

TEST(WithDimTissue, BetweenSkinItIsBody) {
  const Scene scene(1.2, 0);
  const Mask body = WithDimTissue(scene.scan, scene.body, kAir);
  size_t missed = 0, beyond = 0;
  for (size_t v = 0; v < body.values.size(); ++v) {
    const Eigen::Vector3i p = scene.grid.Ijk(v);
    const double r = std::hypot(p.x() - 50.0, p.y() - 20.0);
    missed += !body.values[v] && r > 8 && r < 23;
    beyond += body.values[v] && r >= 23;
  }
  EXPECT_EQ(missed, 0u);
  EXPECT_EQ(beyond, 0u);
}

TEST(WithDimTissue, AirBetweenSkinIsNot) { EXPECT_FALSE(Scene(0, 0).InBody(50, 32)); }

TEST(WithDimTissue, AGhostBesideTheLimbIsNot) {
  const Scene scene(1.2, 1.2);
  EXPECT_TRUE(scene.InBody(50, 32));
  EXPECT_FALSE(scene.InBody(90, 30));
}

TEST(WithDimTissue, AGapOfFourVoxelsStaysOpenWhateverItHolds) {
  Scene scene(0, 0);
  for (size_t v = 0; v < scene.body.values.size(); ++v) {
    const int i = scene.grid.Ijk(v).x();
    scene.body.values[v] = i < 48 || i > 51;
    scene.scan.values[v] = scene.body.values[v] ? 110 : 40;
  }
  EXPECT_EQ(WithDimTissue(scene.scan, scene.body, kAir).values, scene.body.values);
}

}  // namespace
}  // namespace kvx
