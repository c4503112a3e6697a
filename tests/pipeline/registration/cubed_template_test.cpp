// Labels and weights between slices: a rod askew whose outline is known, and means that can be written down.
#include "pipeline/registration/cubed_template.h"

#include <gtest/gtest.h>

#include "core/voxels/finer_grid.h"

namespace kvx {
namespace {

constexpr double kRadiusMm = 8;
const Eigen::Vector3i kTimes(1, 1, 4);

Grid ThickSlices() {
  Grid grid;
  grid.size = {33, 33, 9};
  grid.spacing_mm = {1, 1, 4};
  return grid;
}

// Through the middle, at 45 degrees to the slices.
LabelMap Rod(const Grid& grid) {
  LabelMap rod(grid);
  const Eigen::Vector3d along = Eigen::Vector3d(1, 0, 1).normalized();
  for (size_t v = 0; v < rod.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    rod.values[v] = (x - Eigen::Vector3d::Constant(16)).cross(along).norm() < kRadiusMm ? 7 : 0;
  }
  return rod;
}

TEST(CubedTemplate, OutlinesBetweenSlicesFollowTheShapeAndVoxelsStayAsTheyAre) {
  const Grid thick = ThickSlices(), fine = FinerGrid(thick, kTimes);
  const LabelMap given = Rod(thick), drawn = FinerLabels(given, kTimes), truth = Rod(fine);
  ASSERT_EQ(drawn.grid, fine);
  int wrong = 0, of_nearest = 0;
  for (size_t v = 0; v < truth.values.size(); ++v) {
    const Eigen::Vector3i p = fine.Ijk(v);
    const uint16_t nearest = given(p.x(), p.y(), (p.z() + 2) / 4);
    if (p.z() % 4 == 0) {
      EXPECT_EQ(drawn.values[v], nearest);
    }
    wrong += drawn.values[v] != truth.values[v], of_nearest += nearest != truth.values[v];
  }
  EXPECT_LT(wrong, 0.5 * of_nearest);
}

TEST(CubedTemplate, TwoBonesThatTouchShareTheGapBetweenSlices) {
  LabelMap halves(ThickSlices());
  for (size_t v = 0; v < halves.values.size(); ++v) halves.values[v] = halves.grid.Ijk(v).x() < 16 ? 3 : 5;
  const LabelMap drawn = FinerLabels(halves, kTimes);
  for (size_t v = 0; v < drawn.values.size(); ++v)
    ASSERT_EQ(drawn.values[v], drawn.grid.Ijk(v).x() < 16 ? 3 : 5) << v;
}

TEST(CubedTemplate, WeightsBetweenSlicesAreMeansThatSumToOne) {
  Grid grid;
  grid.size = {1, 1, 2};
  grid.spacing_mm = {1, 1, 2};
  WeightMap weights(grid);
  weights.values[0] = {{0, 1, 0, 0}, {0.75f, 0.25f, 0, 0}};
  weights.values[1] = {{1, 2, 1, 1}, {0.75f, 0.25f, 0, 0}};
  const WeightMap finer = FinerWeights(weights, {1, 1, 2});
  ASSERT_EQ(finer.values.size(), 3u);
  EXPECT_EQ(finer.values[0].weights, weights.values[0].weights);
  const VoxelWeights& between = finer.values[1];
  EXPECT_EQ(between.bones, (std::array<uint8_t, 4>{1, 0, 2, 1}));
  EXPECT_FLOAT_EQ(between.weights[0], 0.5f);
  EXPECT_FLOAT_EQ(between.weights[1], 0.375f);
  EXPECT_FLOAT_EQ(between.weights[2], 0.125f);
}

}  // namespace
}  // namespace kvx
