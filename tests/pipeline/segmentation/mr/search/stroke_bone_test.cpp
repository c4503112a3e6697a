// Marrow of one intensity under noise that is known.
#include "pipeline/segmentation/mr/search/stroke_bone.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

// A change between samples half a voxel apart is an edge when it is half of one between voxels, and so is
// noise.
TEST(StrokeBone, NoiseOfARefinedSearchIsHalfThatOfTheVoxels) {
  const Grid grid = testing_support::Cubes({18, 18, 18}, 1);
  Volume scan(grid);
  LabelMap strokes(grid);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.06);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Array3i p = grid.Ijk(v);
    scan.values[v] = 500 * float(1 + noise(random));
    strokes.values[v] = (p >= 4).all() && (p < 14).all();
  }
  const VoxelBox box{{0, 0, 0}, grid.size};
  const auto noise_of = [&](const StrokeSearch& search) {
    return StrokeBone(scan, strokes, LabelMap(grid), 1, box, search).noise();
  };
  EXPECT_NEAR(noise_of({.tight = true}), 0.06, 0.005);
  EXPECT_NEAR(noise_of({.tight = true, .fine = true}), 0.03, 0.0025);
}

}  // namespace
}  // namespace kvx
