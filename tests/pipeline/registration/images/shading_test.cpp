// A known shading over tissue of several greys is found again, though some samples are of the wrong tissue.
#include "pipeline/registration/images/shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

double True(const Eigen::Vector3d& x) { return 1.3 * std::exp(0.008 * x.x() - 0.00015 * x.y() * x.y()); }

std::vector<ShadingSample> Samples(double wrong_share) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<ShadingSample> out;
  for (int n = 0; n < 4000; ++n) {
    const Eigen::Vector3d x(100 * uniform(random) - 50, 80 * uniform(random), 60 * uniform(random));
    const double grey = 80 + 80 * uniform(random);
    const double seen = uniform(random) < wrong_share ? 80 + 80 * uniform(random) : grey;
    out.push_back({x, grey, True(x) * seen});
  }
  return out;
}

TEST(Shading, IsFoundAgain) {
  for (const double wrong : {0.0, 0.2}) {
    const std::optional<Shading> found = FitShading(Samples(wrong));
    ASSERT_TRUE(found.has_value());
    for (const Eigen::Vector3d& x :
         {Eigen::Vector3d(-40, 10, 30), Eigen::Vector3d(0, 40, 5), Eigen::Vector3d(45, 70, 50)})
      EXPECT_NEAR(found->At(x) / True(x), 1, 0.03);
  }
}

TEST(Shading, BeyondTheSamplesItIsAsAtTheirBorder) {
  const std::optional<Shading> found = FitShading(Samples(0));
  EXPECT_NEAR(found->At({500, 40, 30}), found->At({50, 40, 30}), 0.01);
}

TEST(Shading, OnAGridItIsAsAtEveryVoxel) {
  Shading shading;
  shading.coefficients << 0.1, 0.2, -0.3, 0.4, -0.15, 0.25, 0.35, -0.45, 0.05, 0.3;
  const Grid grid = testing_support::ObliqueGrid({9, 7, 5});
  shading.middle_mm = grid.ToMm(4, 3, 2).lps;
  shading.half_mm = 3 * grid.spacing_mm;  // the grid reaches beyond the box on all sides
  const Volume on = shading.On(grid);
  for (size_t v = 0; v < on.values.size(); ++v) {
    const double at = shading.At(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps);
    EXPECT_NEAR(on.values[v] / at, 1, 1e-5);
  }
}

TEST(Shading, ADarkImageHasNone) {
  EXPECT_FALSE(FitShading(std::vector<ShadingSample>(4000)).has_value());
  EXPECT_FALSE(FitShading(std::vector<ShadingSample>(10)).has_value());
}

}  // namespace
}  // namespace kvx
