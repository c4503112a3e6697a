// A ball that is dense all over, and a bar whose density waxes and wanes about the level.
#include "pipeline/segmentation/ct/threshold_doubt.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kvx {
namespace {

constexpr double kLevelHu = 300;

Volume SoftTissue() {
  Grid grid;
  grid.size = {80, 30, 26};
  grid.spacing_mm = {0.8, 1.0, 1.2};
  return Volume(grid, 40.0f);
}

TEST(KeptOtherwise, ABallStaysTheSame) {
  Volume scan = SoftTissue();
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d mm = scan.grid.Ijk(v).cast<double>().cwiseProduct(scan.grid.spacing_mm);
    if ((mm - Eigen::Vector3d(30, 15, 15)).norm() < 9) scan.values[v] = 900;
  }
  EXPECT_NEAR(KeptOtherwise(scan, kLevelHu), 1, 1e-6);
}

// At the level it is in pieces half as long as its waves; a little lower it is whole, a little higher the
// pieces are a third shorter.
TEST(KeptOtherwise, ABarOfUnevenDensityDoesNot) {
  Volume scan = SoftTissue();
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    if (p.y() < 8 || p.y() > 20 || p.z() < 8 || p.z() > 18) continue;
    scan.values[v] = float(kLevelHu + 50 * std::sin(2 * M_PI * p.x() / 20));
  }
  EXPECT_LT(KeptOtherwise(scan, kLevelHu), 0.75);
}

TEST(KeptOtherwise, IsNothingWhereNothingIsDense) { EXPECT_EQ(KeptOtherwise(SoftTissue(), kLevelHu), 0); }

}  // namespace
}  // namespace kvx
