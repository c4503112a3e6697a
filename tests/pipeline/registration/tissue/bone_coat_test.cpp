// Balls of bone: the coat is a share of their radius.
#include "pipeline/registration/tissue/bone_coat.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr double kSpacingMm = 0.5;
const Eigen::Vector3d kLarge(14, 16, 16), kSmall(32, 16, 16);  // mm
constexpr double kLargeMm = 10, kSmallMm = 4;

struct World {
  WorkRegion region;
  LabelMap labels;

  World() {
    Grid grid;
    grid.size = {80, 64, 64};
    grid.spacing_mm = Eigen::Vector3d::Constant(kSpacingMm);
    labels = LabelMap(grid);
    for (size_t v = 0; v < grid.VoxelCount(); ++v) {
      const Eigen::Vector3d x = kSpacingMm * grid.Ijk(v).cast<double>();
      if ((x - kLarge).norm() <= kLargeMm) labels.values[v] = 1;
      if ((x - kSmall).norm() <= kSmallMm) labels.values[v] = 2;
    }
    region.grid = grid;
  }
  double At(const Volume& volume, const Eigen::Vector3d& mm) const {
    const Eigen::Vector3i p = (mm / kSpacingMm).array().round().cast<int>();
    return volume(p.x(), p.y(), p.z());
  }
};

TEST(BoneCoat, IsAsThickAsTheBone) {
  const World world;
  const Volume beyond_mm = BeyondBoneCoatMm(world.labels, world.region);
  EXPECT_NEAR(world.At(beyond_mm, kLarge), -0.06 * kLargeMm, 0.05);
  EXPECT_NEAR(world.At(beyond_mm, kSmall), -0.06 * kSmallMm, 0.05);
  const Eigen::Vector3d up(0, 0, 1);
  EXPECT_NEAR(world.At(beyond_mm, kLarge + (kLargeMm + 4) * up), 4 - 0.06 * kLargeMm, kSpacingMm);
  EXPECT_NEAR(world.At(beyond_mm, kSmall + (kSmallMm + 4) * up), 4 - 0.06 * kSmallMm, kSpacingMm);
}

TEST(BoneCoat, WithoutBonesEverythingIsFarAway) {
  World world;
  for (auto& label : world.labels.values) label = 0;
  for (const float mm : BeyondBoneCoatMm(world.labels, world.region).values) ASSERT_GT(mm, 1e5f);
}

}  // namespace
}  // namespace kvx
