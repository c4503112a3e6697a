// A pattern that the start puts off by a known part of a voxel.
#include "pipeline/registration/images/start_residual.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kvx {
namespace {

// A pattern of long waves; the start is off along x by `off(x)` voxels, x in voxels.
template <class Off>
BlockLevel Waves(Off off, const Eigen::Vector3i& size = {64, 24, 24}) {
  BlockLevel level;
  level.grid.size = size;
  level.scan = Volume(level.grid);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    const double value = 1000 * (std::sin(0.2 * p.x()) + std::sin(0.2 * p.y()) + std::sin(0.2 * p.z()));
    level.intensity.push_back(float(value));
    level.scan.values[v] = float(value);
    level.weight.push_back(1e-4f);
    level.start.push_back(FieldVector(float(p.x() + off(p.x())), float(p.y()), float(p.z()), 0));
  }
  return level;
}

TEST(StartResidual, SaysHowFarTheStartIsOff) {
  EXPECT_NEAR(StartResidual(Waves([](int) { return 0.0; })).Voxels(), 0, 1e-3);
  for (const double off : {0.2, 0.5})
    EXPECT_NEAR(StartResidual(Waves([=](int) { return off; })).Voxels(), off, 0.15 * off);
}

TEST(StartResidual, CountsBlocksThatTheBorderCuts) {
  EXPECT_NEAR(StartResidual(Waves([](int) { return 0.5; }, {70, 22, 30})).Voxels(), 0.5, 0.075);
  const BlockLevel level = Waves([](int x) { return x < 64 ? 0.0 : 0.5; }, {96, 22, 30});
  const Grid cells = Coarsened(level.grid, 2);
  EXPECT_GT(StartResidual(level).LocalVoxels()[cells.Index(44, 10, 14)], 0.4f) << "the last of its row";
}

TEST(StartResidual, IsLocal) {
  const BlockLevel level = Waves([](int x) { return x < 32 ? 0.0 : 0.5; });
  const std::vector<float> local = StartResidual(level).LocalVoxels();
  const Grid cells = Coarsened(level.grid, 2);
  ASSERT_EQ(local.size(), cells.VoxelCount());
  EXPECT_LT(local[cells.Index(3, 6, 6)], 0.25f);
  EXPECT_GT(local[cells.Index(28, 6, 6)], 0.4f);
}

TEST(StartResidual, WhereTheScanEndsTheWholeLevelDecides) {
  BlockLevel level = Waves([](int x) { return x < 32 ? 0.4 : 1000.0; });
  const std::vector<float> local = StartResidual(level).LocalVoxels();
  const Grid cells = Coarsened(level.grid, 2);
  EXPECT_NEAR(local[cells.Index(28, 6, 6)], StartResidual(level).Voxels(), 1e-3);
}

}  // namespace
}  // namespace kvx
