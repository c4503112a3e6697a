// Signed distances of a drawn box and of thick slices.
#include "core/voxels/distance_map.h"

#include <gtest/gtest.h>

#include "tests/support/drawn_box.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(SignedDistance, OfABoxAlongItsAxes) {
  const Grid grid = ObliqueGrid({60, 50, 40});
  const Eigen::Vector3d centre = MiddleOf(grid);
  const Volume distance = SignedDistance(DrawnBox(grid, centre, 5), 5, 8.0);
  const double voxel = grid.spacing_mm.maxCoeff();
  for (const double beyond : {-3.0, -1.5, 1.5, 4.0, 6.0}) {
    const PointMm x{centre + (kHalf[0] + beyond) * kAxes.col(0)};
    EXPECT_NEAR(SampleTrilinear(distance, distance.grid.ToVox(x), 99), beyond, 0.9 * voxel)
        << beyond << " mm beyond the end";
  }
}

TEST(SignedDistance, HasTheSignOfTheLabelInThinVoxelsOfThickSlices) {
  LabelMap labels(Grid{});
  labels.grid.size = {12, 12, 8};
  labels.grid.spacing_mm = {0.3, 0.3, 4};
  labels = LabelMap(labels.grid);
  for (int k = 2; k < 6; ++k) {
    for (int n = 0; n < 16; ++n) labels(4 + n % 4, 4 + n / 4, k) = 5;
  }
  const Volume distance = SignedDistance(labels, 5, 1);
  for (size_t v = 0; v < distance.values.size(); ++v) {
    const PointVox at = labels.grid.ToVox(distance.grid.ToMm(PointVox{distance.grid.Ijk(v).cast<double>()}));
    const Eigen::Vector3i p = at.ijk.array().round().cast<int>();
    EXPECT_EQ(distance.values[v] < 0, labels(p.x(), p.y(), p.z()) == 5) << p.transpose();
  }
}

}  // namespace
}  // namespace kvx
