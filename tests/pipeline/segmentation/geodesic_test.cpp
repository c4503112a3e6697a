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

// Up a step of 0.6 and down again: what pays for falls alone pays on the way down, and the other way round.
TEST(GeodesicDistance, PaysForFallsOrRisesAlone) {
  Grid grid;
  grid.size = {9, 3, 3};
  Volume picture(grid, 0.4f);
  for (size_t v = 0; v < picture.values.size(); ++v) {
    const int i = grid.Ijk(v).x();
    if (i >= 3 && i < 6) picture.values[v] = 1.0f;
  }
  GeodesicOptions options{.mm_per_contrast = 10, .noise = 0.1, .paid = GeodesicOptions::kFalls};
  const Image<float> falls = GeodesicDistance(picture, {{grid.Index(0, 1, 1), 0}}, options);
  EXPECT_NEAR(falls(4, 1, 1), 4, 1e-4);
  EXPECT_NEAR(falls(8, 1, 1), 8 + 10 * (0.6 - 0.1), 1e-4);
  options.paid = GeodesicOptions::kRises;
  const Image<float> rises = GeodesicDistance(picture, {{grid.Index(0, 1, 1), 0}}, options);
  EXPECT_NEAR(rises(2, 1, 1), 2, 1e-4);
  EXPECT_NEAR(rises(4, 1, 1), 4 + 10 * (0.6 - 0.1), 1e-4);
}

}  // namespace
}  // namespace kvx
