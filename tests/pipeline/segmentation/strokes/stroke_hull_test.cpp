// Hulls whose distance is known.
#include "pipeline/segmentation/strokes/stroke_hull.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(StrokeHull, OfOnePointIsTheDistanceFromIt) {
  const StrokeHull hull({PointMm{{3, -2, 7}}});
  const Eigen::Vector3d away = Eigen::Vector3d(2, -1, 2) / 3;
  EXPECT_NEAR(hull.BeyondMm({Eigen::Vector3d(3, -2, 7) + 6 * away}), 6, 0.14);  // within 12 degrees: 2 %
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
  EXPECT_LE(hull.BeyondMm({Eigen::Vector3d(5, 4, 2)}), 2.0 + 1e-9);
}

// Three short lines that lie askew, turned and mirrored about any point.
TEST(StrokeHull, TurnsAndMirrorsWithItsStrokes) {
  std::vector<PointMm> strokes;
  for (int n = 0; n < 8; ++n) {
    strokes.push_back({Eigen::Vector3d(n, 0.4 * n, 1)});
    strokes.push_back({Eigen::Vector3d(15 - 0.3 * n, n, 0.5 * n)});
    strokes.push_back({Eigen::Vector3d(4, 9, 1.5 * n)});
  }
  const StrokeHull hull(strokes);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  for (const double mirror : {1.0, -1.0}) {
    const Eigen::Matrix3d linear = turn * Eigen::Vector3d(mirror, 1, 1).asDiagonal();
    const auto moved = [&](const Eigen::Vector3d& mm) {
      return PointMm{linear * mm + Eigen::Vector3d(40, -300, 7)};
    };
    std::vector<PointMm> all;
    for (const PointMm& stroke : strokes) all.push_back(moved(stroke.lps));
    const StrokeHull other(all);
    for (int n = 0; n < 27; ++n) {
      const Eigen::Vector3d mm = 12.0 * Eigen::Vector3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      EXPECT_NEAR(other.BeyondMm(moved(mm)), hull.BeyondMm({mm}), 1e-6);
    }
  }
}

}  // namespace
}  // namespace kvx
