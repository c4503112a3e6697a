// Two fingers with a gap of air between them, and a start that moves one of them.
#include "pipeline/registration/images/closed_air.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

// Tissue from 4 to 15 and from 24 to 35 along x; the second finger and the air nearer to it are moved.
struct Fingers {
  Mask body;
  std::vector<Eigen::Vector4f> start;

  explicit Fingers(float second_moves_by) {
    Grid grid;
    grid.size = {40, 6, 6};
    body = Mask(grid);
    for (size_t v = 0; v < grid.VoxelCount(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v);
      body.values[v] = (p.x() >= 4 && p.x() <= 15) || (p.x() >= 24 && p.x() <= 35);
      start.emplace_back(float(p.x()) + (p.x() >= 20 ? second_moves_by : 0), float(p.y()), float(p.z()), 0);
    }
  }
  std::vector<int> Closed() const {  // x of the closed air in one row
    std::vector<int> out;
    const Mask closed = ClosedAir(body, start, body.grid);
    for (int x = 0; x < body.grid.size.x(); ++x)
      if (closed(x, 3, 3)) out.push_back(x);
    return out;
  }
};

TEST(ClosedAir, OpenAirAndSmallErrorsOfTheStartStay) {
  EXPECT_TRUE(Fingers(0).Closed().empty());
  EXPECT_TRUE(Fingers(-3).Closed().empty());
}

TEST(ClosedAir, AirThatLandsInTheOtherFingerIsClosed) {
  // 24 lands at 16, beside the first finger: the air from 20 to 23 lands in that, what was 8 voxels away.
  EXPECT_EQ(Fingers(-8).Closed(), (std::vector<int>{16, 17, 18, 19, 20, 21, 22, 23}));
}

TEST(ClosedAir, WhatLandsOutsideTheScanIsNot) { EXPECT_TRUE(Fingers(-100).Closed().empty()); }

}  // namespace
}  // namespace kvx
