// The levels that a start from far off is given.
#include "pipeline/registration/blocks/level_builder.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/artifacts/held.h"
#include "tests/support/fixtures.h"
#include "tests/support/in_place.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {
using namespace testing_support;

// Lumps of 20 mm that lie 30 mm off in the scan: farther than three levels reach.
Scan Lumps(const Grid& grid, double shift_mm) {
  Scan scan{Volume(grid)};
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    x.x() -= shift_mm;
    scan.volume.values[v] = float(100 + 20 * std::sin(x.x() / 7) + 30 * std::sin(x.x() / 40) +
                                  20 * std::cos(x.y() / 8) * std::sin(x.z() / 9));
  }
  return scan;
}

std::vector<BlockLevel> LevelsOf(const Eigen::Vector3i& body_size) {
  const Grid grid = PlainGrid(body_size, {1, 1, 1}, {0, 0, 0});
  const auto image = Held(Lumps(grid, 0)), scan = Held(Lumps(grid, 30));
  const auto body = Held(Mask(grid, 1));
  const auto bones = Held(BoneSet{{}, LabelMap(grid)});
  const auto weights = Held(WeightMap(grid));
  const auto fits = Held(BoneFits());
  const RegistrationInputs inputs{image, body, bones, weights, fits, scan};
  const WorkRegion region = RegionOfLevels(*body);
  const Volume beyond_coat_mm(region.grid, 1e3f);
  LevelBuilder builder(inputs, {1, 1, 1}, beyond_coat_mm, region, SharedBackend());
  return builder.Build(InPlace(region.grid));
}

// 88 and two blocks are 104 voxels, an odd multiple of 8. Cells of 2 x 2 x 2 voxels would write beyond the
// end.
TEST(LevelBuilder, EveryLevelHasAnEvenNumberOfVoxels) {
  for (const Eigen::Vector3i& size : {Eigen::Vector3i(88, 88, 88), Eigen::Vector3i(88, 80, 40)}) {
    const std::vector<BlockLevel> levels = LevelsOf(size);
    EXPECT_EQ(levels.size(), size.z() == 88 ? 4u : 3u);
    for (size_t l = 0; l < levels.size(); ++l) {
      EXPECT_TRUE((levels[l].grid.size.array().unaryExpr([](int n) { return n % 2; }) == 0).all()) << l;
      EXPECT_EQ(levels[l].weight.size(), levels[l].grid.VoxelCount());
      EXPECT_EQ(levels[l].template_voxels, 1 << l);
    }
  }
}

}  // namespace
}  // namespace kvx
