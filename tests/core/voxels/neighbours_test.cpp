// The steps by hand.
#include "core/voxels/neighbours.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace kvx {
namespace {

TEST(StepToSide, GoesBackAndForthAlongEveryAxis) {
  std::vector<Eigen::Vector3i> steps;
  for (int side = 0; side < 6; ++side) steps.push_back(StepToSide(side));
  using V = Eigen::Vector3i;
  EXPECT_THAT(
      steps, testing::ElementsAre(V(-1, 0, 0), V(1, 0, 0), V(0, -1, 0), V(0, 1, 0), V(0, 0, -1), V(0, 0, 1)));
}

}  // namespace
}  // namespace kvx
