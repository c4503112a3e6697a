// Hulls whose distance is known.
#include "pipeline/segmentation/strokes/stroke_hull.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(StrokeHull, OfOnePointIsTheDistanceFromIt) {
  const StrokeHull hull({PointMm{{3, -2, 7}}});
  const Eigen::Vector3d away = Eigen::Vector3d(2, -1, 2) / 3;
  EXPECT_NEAR(hull.BeyondMm({Eigen::Vector3d(3, -2, 7) + 6 * away}), 6, 0.06);  // 150 directions: 1 %
}

TEST(StrokeHull, OfABallsPointsGrowsWithTheRadius) {
  std::vector<PointMm> ball;
  for (int i = -5; i <= 5; ++i) {
    for (int j = -5; j <= 5; ++j) {
      for (int k = -5; k <= 5; ++k) {
        if (i * i + j * j + k * k <= 25) ball.push_back({Eigen::Vector3d(2 * i, 2 * j, 2 * k)});
      }
    }
  }
  const StrokeHull hull(ball);
  EXPECT_LT(hull.BeyondMm({Eigen::Vector3d::Zero()}), -9);
  EXPECT_NEAR(hull.BeyondMm({Eigen::Vector3d(14, 0, 0)}), 4, 0.2);
  EXPECT_NEAR(hull.BeyondMm({Eigen::Vector3d(0, 0, -13)}), 3, 0.2);
}

TEST(StrokeHull, TwoLinesFillWhatIsBetweenThem) {
  std::vector<PointMm> lines;
  for (int n = 0; n <= 10; ++n) {
    lines.push_back({Eigen::Vector3d(n, 0, 0)});
    lines.push_back({Eigen::Vector3d(n, 8, 0)});
  }
  const StrokeHull hull(lines);
  EXPECT_LT(hull.BeyondMm({Eigen::Vector3d(5, 4, 0)}), 0.05);
  EXPECT_GT(hull.BeyondMm({Eigen::Vector3d(5, 4, 2)}), 1.0);
  EXPECT_LE(hull.BeyondMm({Eigen::Vector3d(5, 4, 2)}), 2.0);
}

}  // namespace
}  // namespace kvx
