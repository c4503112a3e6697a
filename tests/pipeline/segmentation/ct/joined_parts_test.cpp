// Bodies of one density, cut in two: seams and cross-sections can be written down.
#include "pipeline/segmentation/ct/joined_parts.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

constexpr float kDenseHu = 800;

// What `inside` holds, cut in two by the plane x = cut_mm.
struct CutBody {
  Volume scan;
  NeckParts parts;

  template <class Inside>
  CutBody(double cut_mm, float depth_mm, const Inside& inside) {
    const Grid grid = testing_support::Cubes({90, 50, 50}, 0.5);
    scan = Volume(grid, 40.0f);
    parts = {Image<int32_t>(grid, 0), {0.0f, depth_mm, depth_mm}};
    for (size_t v = 0; v < scan.values.size(); ++v) {
      const Eigen::Vector3d mm = grid.Ijk(v).cast<double>() * 0.5 - Eigen::Vector3d(0, 12.2, 12.2);
      if (!inside(mm)) continue;
      scan.values[v] = kDenseHu;
      parts.part.values[v] = mm.x() < cut_mm ? 1 : 2;
    }
  }
  size_t PartsAt(double least_seam) const {
    const Image<int32_t> joined = JoinedParts(scan, parts, least_seam);
    return std::set<int32_t>(joined.values.begin(), joined.values.end()).size() - 1;
  }
};

bool InHollowBall(const Eigen::Vector3d& mm, double x_mm) {
  const double r = (mm - Eigen::Vector3d(x_mm, 0, 0)).norm();
  return r < 8 && r > 6.5;
}

// The seam of a rod cut across is its cross-section; of a plane across an axis 0.94 are counted.
TEST(JoinedParts, ARodGoesOnThroughACutWithAllOfItsCrossSection) {
  const CutBody rod(20, 0.5f, [](const Eigen::Vector3d& mm) {
    return mm.x() > 4 && mm.x() < 40 && std::hypot(mm.y(), mm.z()) < 6;
  });
  EXPECT_EQ(rod.PartsAt(0.85), 1u);
  EXPECT_EQ(rod.PartsAt(1.0), 2u);
}

TEST(JoinedParts, ATubeIsOne) {
  const CutBody tube(20, 1.5f, [](const Eigen::Vector3d& mm) {
    const double r = std::hypot(mm.y(), mm.z());
    return mm.x() > 4 && mm.x() < 40 && r < 6 && r > 4.5;
  });
  EXPECT_EQ(tube.PartsAt(kLeastSeam), 1u);
}

// They share a disc of 15 mm2; the mean cross-section of each, mineral over its 16 mm, is some 65 mm2.
TEST(JoinedParts, HollowBallsThatTouchStayTwo) {
  const CutBody balls(
      16, 1.5f, [](const Eigen::Vector3d& mm) { return InHollowBall(mm, 8.3) || InHollowBall(mm, 23.7); });
  EXPECT_EQ(balls.PartsAt(kLeastSeam), 2u);
  EXPECT_EQ(balls.PartsAt(0.1), 1u);
}

// Of what is filled depth has told where necks are.
TEST(JoinedParts, SolidHalvesStayTwo) {
  const CutBody ball(20, 4.0f,
                     [](const Eigen::Vector3d& mm) { return (mm - Eigen::Vector3d(20, 0, 0)).norm() < 8; });
  EXPECT_EQ(ball.PartsAt(kLeastSeam), 2u);
}

}  // namespace
}  // namespace kvx
