// In an even picture a way along an axis costs its length; a step in the picture costs its height more.
#include "pipeline/segmentation/strokes/geodesic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

// Distances passed on to all neighbours until nothing changes.
std::vector<float> Relaxed(const Volume& picture, size_t from, const GeodesicOptions& options) {
  const Grid& grid = picture.grid;
  std::vector<float> distance(grid.VoxelCount(), INFINITY);
  distance[from] = 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t a = 0; a < distance.size(); ++a) {
      for (size_t b = 0; b < distance.size(); ++b) {
        const Eigen::Vector3i step = grid.Ijk(b) - grid.Ijk(a);
        if (step.cwiseAbs().maxCoeff() != 1 || step.cwiseAbs().sum() > 2) continue;
        const double contrast = std::abs(double(picture.values[b]) - picture.values[a]) - options.noise;
        const double mm = step.cast<double>().cwiseProduct(grid.spacing_mm).norm();
        const float way = distance[a] + float(mm + options.mm_per_contrast * std::max(0.0, contrast));
        if (way < distance[b]) distance[b] = way, changed = true;
      }
    }
  }
  return distance;
}

TEST(GeodesicDistance, IsTheShortestOfAllWaysInARandomPicture) {
  Grid grid;
  grid.size = {7, 6, 5};
  grid.spacing_mm = {0.7, 1.1, 2};
  Volume picture(grid);
  std::mt19937 random(11);
  for (float& value : picture.values) value = float(random() % 1000) / 1000;
  const GeodesicOptions options{.mm_per_contrast = 8};
  const size_t from = grid.Index(0, 5, 2);
  EXPECT_EQ(GeodesicDistance(picture, {{from, 0}}, options).values, Relaxed(picture, from, options));
}

}  // namespace
}  // namespace kvx
