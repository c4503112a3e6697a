// In an even picture a way along an axis costs its length; a step in the picture costs its height more.
#include "pipeline/segmentation/geodesic.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kvx {
namespace {

TEST(GeodesicDistance, IsLengthPlusContrast) {
  Grid grid;
  grid.size = {9, 7, 5};
  grid.spacing_mm = {0.5, 2, 3};
  Volume picture(grid, 1.0f);
  for (size_t v = 0; v < picture.values.size(); ++v) {
    if (grid.Ijk(v).x() >= 6) picture.values[v] = 0.4f;
  }
  const Image<float> distance =
      GeodesicDistance(picture, {{grid.Index(2, 3, 2), 0}}, {.mm_per_contrast = 10, .noise = 0.1});
  EXPECT_NEAR(distance(5, 3, 2), 3 * 0.5, 1e-5);
  EXPECT_NEAR(distance(2, 5, 2), 2 * 2, 1e-5);
  EXPECT_NEAR(distance(3, 4, 2), std::hypot(0.5, 2), 1e-5);
  EXPECT_NEAR(distance(8, 3, 2), 6 * 0.5 + 10 * (0.6 - 0.1), 1e-4);
}

TEST(GeodesicDistance, StopsAtTheMostAndStartsLateWhereTold) {
  Grid grid;
  grid.size = {12, 3, 3};
  const Image<float> distance = GeodesicDistance(Volume(grid, 1.0f), {{grid.Index(0, 1, 1), 2.0f}},
                                                 {.mm_per_contrast = 10, .most_mm = 6.5});
  EXPECT_NEAR(distance(0, 1, 1), 2, 1e-6);
  EXPECT_NEAR(distance(4, 1, 1), 6, 1e-6);
  EXPECT_TRUE(std::isinf(distance(5, 1, 1)));
}

}  // namespace
}  // namespace kvx
