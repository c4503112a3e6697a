// A cube of marrow in dark cortex, in voxels of 1 mm.
#include "pipeline/segmentation/mr/levels/dark_inside.h"

#include <gtest/gtest.h>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

constexpr float kMarrow = 200;
const VoxelBox kBone{{3, 4, 5}, {13, 14, 15}};

Volume Bright() { return Volume(testing_support::Cubes({20, 20, 20}, 1), kMarrow); }

void Fill(Volume& scan, const VoxelBox& box, float grey) {
  ForEachVoxel(box, [&](const Eigen::Vector3i& p) { scan(p.x(), p.y(), p.z()) = grey; });
}

double OfTheBone(const Volume& scan) {
  return DarkInside(scan, kMarrow, kBone, Mask(GridOf(kBone, scan.grid), 1));
}

TEST(DarkInside, CortexUnderTheSurfaceIsNone) {
  // The box ends where the bone does, so a frame of what is outside is needed.
  const Grid grid = Bright().grid;
  const VoxelBox around{{0, 0, 0}, grid.size};
  Mask mask(grid);
  ForEachVoxel(kBone, [&](const Eigen::Vector3i& p) { mask(p.x(), p.y(), p.z()) = 1; });
  Volume scan(grid, 0.1f * kMarrow);
  Fill(scan, {{4, 5, 6}, {12, 13, 14}}, kMarrow);
  EXPECT_EQ(DarkInside(scan, kMarrow, around, mask), 0);
  Fill(scan, {{6, 5, 6}, {8, 13, 14}}, 0.6f * kMarrow);  // two of the eight layers
  EXPECT_EQ(DarkInside(scan, kMarrow, around, mask), 0.25);
  Fill(scan, {{6, 5, 6}, {8, 13, 14}}, 0.75f * kMarrow);
  EXPECT_EQ(DarkInside(scan, kMarrow, around, mask), 0);
}

TEST(DarkInside, WhereTheViewCutsABoneItGoesOn) {
  Volume scan = Bright();
  Fill(scan, {{3, 4, 5}, {8, 14, 15}}, 0);
  EXPECT_EQ(OfTheBone(scan), 0.5);
}

TEST(DarkInside, NothingLiesDeepInAThinOne) {
  const Volume scan(Bright().grid, 0);
  Mask mask(scan.grid);
  mask(5, 5, 5) = 1;
  EXPECT_EQ(DarkInside(scan, kMarrow, {{0, 0, 0}, scan.grid.size}, mask), 0);
}

}  // namespace
}  // namespace kvx
