// Where a small body lands in a large scan.
#include "pipeline/registration/region/landing_box.h"

#include <gtest/gtest.h>

#include "pipeline/artifacts/held.h"
#include "tests/support/fixtures.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {
using namespace testing_support;

// A body of 8 mm about (50, 50, 50), on one bone that the scan's pose moves.
VoxelBox BoxAfter(const RigidTransform& motion, const Grid& scan_grid) {
  const Grid grid = PlainGrid({100, 100, 100}, {1, 1, 1}, {0, 0, 0});
  Mask body(grid);
  for (const Eigen::Vector3i& p : {Eigen::Vector3i(46, 46, 46), Eigen::Vector3i(54, 54, 54)})
    body(p.x(), p.y(), p.z()) = 1;
  VoxelWeights rigid;
  rigid.weights[0] = 1;
  const auto image = Held(Scan{Volume(grid)});
  const auto held_body = Held(body);
  const auto bones = Held(BoneSet{{}, LabelMap(grid)});
  const auto weights = Held(WeightMap(grid, rigid));
  BoneFits fitted(1);
  fitted[0].scan_from_template = motion;
  const auto fits = Held(fitted);
  return LandingBox({image, held_body, bones, weights, fits, image}, scan_grid);
}

TEST(LandingBox, IsWhereTheBonesCarryTheBodyAndSomeMore) {
  const Grid scan = PlainGrid({300, 300, 300}, {2, 2, 2}, {-100, -100, -100});
  const VoxelBox box = BoxAfter({Eigen::Quaterniond::Identity(), Eigen::Vector3d(100, 0, 0)}, scan);
  for (int a = 0; a < 3; ++a) {
    const double first_mm = a == 0 ? 146 : 46, last_mm = a == 0 ? 154 : 54;
    EXPECT_EQ(box.low[a], int((first_mm - kLandingSpareMm + 100) / 2)) << a;
    EXPECT_EQ(box.high[a], int((last_mm + kLandingSpareMm + 100) / 2) + 1) << a;
  }
}

TEST(LandingBox, StaysInTheScanHoweverFarOffTheBodyLands) {
  const Grid scan = PlainGrid({60, 60, 60}, {2, 2, 2}, {0, 0, 0});
  const VoxelBox box = BoxAfter({Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 900, 0)}, scan);
  EXPECT_EQ(box.low, Eigen::Vector3i(3, 39, 3));     // 46 and 54 mm along x and z, the last plane along y
  EXPECT_EQ(box.high, Eigen::Vector3i(48, 60, 48));  // and 40 mm around
}

}  // namespace
}  // namespace kvx
