// Trilinear samples against ramps, which they hold exactly, and against eight corners by hand.
#include "core/image.h"

#include <gtest/gtest.h>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::LinearRamp;
using testing_support::ObliqueGrid;

TEST(Image, OfVectorsIsZeroUnlessAValueIsGiven) {
  const Grid grid = ObliqueGrid({9, 8, 7});
  { DisplacementField used(grid, Eigen::Vector3f::Constant(7)); }  // what memory held before
  for (const Eigen::Vector3f& u : DisplacementField(grid).values) EXPECT_EQ(u, Eigen::Vector3f::Zero());
}

TEST(SampleTrilinear, ARampIsExactEverywhereWithinTheVoxelsCentres) {
  const Grid grid = ObliqueGrid({6, 5, 4});
  const LinearRamp ramp;
  const Volume volume = ramp.On(grid);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(1.25, 2.5, 0.125), Eigen::Vector3d(0, 0, 0),
                                   Eigen::Vector3d(4.75, 3.9, 2.6), Eigen::Vector3d(5, 4, 3)}) {
    EXPECT_NEAR(SampleTrilinear(volume, PointVox{p}), ramp.At(grid.ToMm(PointVox{p})), 1e-4) << p.transpose();
  }
}

// A corner counts by the product of what the point is near along each axis.
TEST(SampleTrilinear, EachOfTheEightCornersCountsByHowNearItIs) {
  const Eigen::Vector3d p(0.25, 0.5, 0.8);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i at(corner & 1, corner >> 1 & 1, corner >> 2);
    Volume one(ObliqueGrid({2, 2, 2}), 0.0f);
    one(at.x(), at.y(), at.z()) = 1;
    double share = 1;
    for (int a = 0; a < 3; ++a) share *= at[a] ? p[a] : 1 - p[a];
    EXPECT_NEAR(SampleTrilinear(one, PointVox{p}), share, 1e-7) << corner;
  }
}

TEST(SampleTrilinear, BeyondTheVoxelsCentresAVolumeIsWhatIsOutsideAndAFieldGoesOn) {
  const Grid grid = ObliqueGrid({4, 3, 2});
  EXPECT_EQ(SampleTrilinear(Volume(grid, 7.0f), PointVox{{3.01, 1, 1}}, -5), -5);
  EXPECT_EQ(SampleTrilinear(Volume(grid, 7.0f), PointVox{{-0.01, 1, 1}}, -5), -5);
  DisplacementField field(grid);
  for (size_t v = 0; v < field.values.size(); ++v) field.values[v] = grid.Ijk(v).cast<float>();
  EXPECT_TRUE(SampleTrilinear(field, PointVox{{1.5, 0.25, 0.75}}).isApprox(Eigen::Vector3d(1.5, 0.25, 0.75)));
  EXPECT_EQ(SampleTrilinear(field, PointVox{{9, 1, -4}}), Eigen::Vector3d(3, 1, 0));
}

TEST(SampleTrilinear, AGridOfOneSliceIsReadInItsPlane) {
  const LinearRamp ramp;
  const Grid grid = ObliqueGrid({5, 4, 1});
  EXPECT_NEAR(SampleTrilinear(ramp.On(grid), PointVox{{2.5, 1.75, 0}}), ramp.At(grid.ToMm({{2.5, 1.75, 0}})),
              1e-4);
}

}  // namespace
}  // namespace kvx
