// The same voxels, turned about their middle.
#include "pipeline/bones/images/half_turned.h"

#include <gtest/gtest.h>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

TEST(HalfTurned, EveryVoxelLiesWhereTheTurnTakesIt) {
  const Volume scan(testing_support::ObliqueGrid({9, 7, 5}), 3.0f);
  const Eigen::Vector3d middle = scan.grid.ToMm(4, 3, 2).lps;
  for (int axis = 0; axis < 3; ++axis) {
    const HalfTurned turned = TurnedByHalf(scan, axis);
    EXPECT_EQ(turned.scan.values, scan.values);
    EXPECT_LT((turned.scan.grid.ToMm(4, 3, 2).lps - middle).norm(), 1e-9);
    for (const Eigen::Vector3i& at : {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(8, 1, 4)}) {
      const PointMm before = scan.grid.ToMm(at.x(), at.y(), at.z());
      const Eigen::Vector3d after = turned.scan.grid.ToMm(at.x(), at.y(), at.z()).lps;
      EXPECT_LT(((turned.turned_from_scan * before).lps - after).norm(), 1e-9);
      EXPECT_NEAR((after - middle)[axis], (before.lps - middle)[axis], 1e-9);
      for (const int other : {(axis + 1) % 3, (axis + 2) % 3})
        EXPECT_NEAR((after - middle)[other], -(before.lps - middle)[other], 1e-9);
    }
  }
}

}  // namespace
}  // namespace kvx
