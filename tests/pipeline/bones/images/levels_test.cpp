// Coarser and finer again.
#include "pipeline/bones/images/levels.h"

#include <gtest/gtest.h>

#include "core/voxels/sample_clamped.h"
#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

// Oracle: the same places looked up one by one.
TEST(Levels, OnFinerGridIsLinearBetweenCoarseVoxelsAndConstantBeyond) {
  const Grid grid = ObliqueGrid({23, 17, 11});
  Volume rough(grid);
  for (size_t v = 0; v < rough.values.size(); ++v) rough.values[v] = float((v * 7919) % 101);
  const Volume coarse = CoarsenedTo(rough, 3.1 * grid.MeanSpacingMm());
  ASSERT_LT(coarse.values.size() * 8, rough.values.size());
  const Volume fine = OnFinerGrid(coarse, grid);
  ASSERT_TRUE(fine.grid == grid);
  for (size_t v = 0; v < fine.values.size(); ++v) {
    const PointMm at = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    ASSERT_NEAR(fine.values[v], SampleClamped(coarse, coarse.grid.ToVox(at)), 1e-3)
        << grid.Ijk(v).transpose();
  }
}

TEST(Levels, OneVoxelAlongAnAxisIsConstantAlongIt) {
  Volume thin(Box({5, 1, 1}, {4, 9, 9}, Eigen::Matrix3d::Identity()));
  for (int i = 0; i < 5; ++i) thin.values[size_t(i)] = float(i);
  const Volume fine = OnFinerGrid(thin, Box({5, 3, 3}, {4, 3, 3}, Eigen::Matrix3d::Identity()));
  for (size_t v = 0; v < fine.values.size(); ++v) EXPECT_EQ(fine.values[v], float(v % 5));
}

TEST(Levels, NormalisedHasNoMeanAndUnitSpreadWhateverIsNoNumber) {
  Volume volume(ObliqueGrid({7, 6, 5}));
  for (size_t v = 0; v < volume.values.size(); ++v) volume.values[v] = float(1000 + (v * 37) % 19);
  volume.values[3] = std::nanf("");
  const Volume out = Normalised(volume);
  double sum = 0, squares = 0;
  for (const float value : out.values) sum += value, squares += double(value) * value;
  EXPECT_EQ(out.values[3], 0);
  EXPECT_NEAR(sum, 0, 1e-3);
  EXPECT_NEAR(squares / double(out.values.size() - 1), 1, 1e-4);
}

}  // namespace
}  // namespace kvx
