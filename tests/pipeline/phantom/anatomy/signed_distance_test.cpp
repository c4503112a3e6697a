// Shapes against distances that can be written down.
#include "pipeline/phantom/anatomy/signed_distance.h"

#include <gtest/gtest.h>

namespace kvx::phantom {
namespace {

using V = Eigen::Vector3d;

TEST(RoundConeDistance, OfEqualRadiiIsACapsule) {
  const RoundCone capsule{V(0, 0, 0), V(0, 10, 0), 2, 2};
  EXPECT_NEAR(Distance(capsule, V(5, 4, 0)), 3, 1e-12);
  EXPECT_NEAR(Distance(capsule, V(0, 15, 0)), 3, 1e-12);
  EXPECT_NEAR(Distance(capsule, V(0, -3, 4)), 3, 1e-12);
  EXPECT_NEAR(Distance(capsule, V(0, 5, 0)), -2, 1e-12);
}

TEST(RoundConeDistance, SlantedSideTouchesBothBalls) {
  const RoundCone cone{V(0, 0, 0), V(10, 0, 0), 5, 2};  // sine of the slope: 3 / 10
  const double cosine = std::sqrt(1 - 0.09);
  const V normal(0.3, cosine, 0), on_side = 0.5 * (5 * normal + V(10, 0, 0) + 2 * normal);
  EXPECT_NEAR(Distance(cone, on_side), 0, 1e-12);
  EXPECT_NEAR(Distance(cone, on_side + 1.5 * normal), 1.5, 1e-12);
  EXPECT_NEAR(Distance(cone, V(-7, 0, 0)), 2, 1e-12);
  EXPECT_NEAR(Distance(cone, V(14, 0, 0)), 2, 1e-12);
}

TEST(RoundConeDistance, ABallInsideTheOtherDoesNotMatter) {
  EXPECT_NEAR(Distance(RoundCone{V(0, 0, 0), V(1, 0, 0), 5, 2}, V(9, 0, 0)), 4, 1e-12);
}

TEST(EllipsoidDistance, IsExactForASphereAndZeroOnTheSurface) {
  EXPECT_NEAR(Distance(Ellipsoid{V(1, 2, 3), V(4, 4, 4)}, V(1, 2, 10)), 3, 1e-12);
  const V direction = V(1, -2, 2).normalized();
  EXPECT_NEAR(Distance(Ellipsoid{V::Zero(), V(3, 5, 7)}, direction.cwiseProduct(V(3, 5, 7))), 0, 1e-12);
}

TEST(SmoothMin, IsTheMinimumFarFromTheSeamAndBelowItThere) {
  EXPECT_DOUBLE_EQ(SmoothMin(1, 5, 3), 1);
  EXPECT_DOUBLE_EQ(SmoothMin(2, 2, 3), 2 - 3.0 / 6.0);
  EXPECT_DOUBLE_EQ(SmoothMin(1.5, 2.5, 3), SmoothMin(2.5, 1.5, 3));
}

TEST(Shape, IsCutByItsPlanesAndBoundedByItsBox) {
  Shape shape{{{V(0, -20, 0), V(0, 20, 0), 3, 3}}, {}, 0};
  shape.cut_high.y() = 10;
  EXPECT_NEAR(shape.Distance(V(0, 14, 0)), 4, 1e-12);
  EXPECT_NEAR(shape.Distance(V(0, 8, 0)), -2, 1e-12);
  EXPECT_DOUBLE_EQ(shape.Bounds().high.y(), 10);
  EXPECT_DOUBLE_EQ(shape.Bounds().low.y(), -23);
}

}  // namespace
}  // namespace kvx::phantom
