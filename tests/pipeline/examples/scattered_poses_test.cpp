// Distances and shares among a few points of a plane.
#include "pipeline/examples/scattered_poses.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

Eigen::MatrixXd Triangle() { return Eigen::MatrixXd{{0, 0}, {1, 0}, {0, 1}}; }

TEST(DistanceToHull, IsZeroInsideAndGoesToTheNearestCornerOrSideOutside) {
  const std::pair<Eigen::RowVector2d, double> places[] = {
      {{0.3, 0.3}, 0},          {{0, 1}, 0},   {{0.5, 0.5}, 0}, {{0.25, -0.5}, 0.5},
      {{1, 1}, std::sqrt(0.5)}, {{-3, -4}, 5}, {{3, 0}, 2}};
  for (const auto& [at, distance] : places) EXPECT_NEAR(DistanceToHull(Triangle(), at), distance, 1e-4) << at;
}

TEST(DistanceToHull, OfOnePoseIsTheDistanceToIt) {
  EXPECT_NEAR(DistanceToHull(Eigen::MatrixXd{{1, 2, 3}}, Eigen::RowVector3d(2, 4, 5)), 3, 1e-12);
}

TEST(SharesByDistance, FallByTheWidthAndSumToOne) {
  const Eigen::MatrixXd centres{{0}, {3}};
  const auto shares = [&](double at) { return SharesByDistance(centres, 2, Eigen::RowVectorXd{{at}}); };
  EXPECT_NEAR(shares(1.5)[0], 0.5, 1e-12);
  EXPECT_NEAR(shares(1)[0] / shares(1)[1], std::exp(0.5), 1e-12) << "1 from one and 2 from the other";
  EXPECT_NEAR(shares(1).sum(), 1, 1e-12);
  EXPECT_NEAR(shares(1e6)[1], 1 / (1 + std::exp(-1.5)), 1e-9) << "far from all it goes by what is nearest";
}

TEST(TypicalDistance, IsTheMeanOverAllPairs) {
  EXPECT_NEAR(TypicalDistance(Eigen::MatrixXd{{0, 0}, {3, 0}, {3, 4}}), 4, 1e-12) << "3, 4 and 5";
  EXPECT_EQ(TypicalDistance(Eigen::MatrixXd{{0, 0}}), 1);
}

TEST(DistinctPoses, AreNoTwoWithinATenthOfADegree) {
  const double near = RadFromDeg(0.09), apart = RadFromDeg(0.11);
  // The second angle is none of those that matter
  PoseRows scans(4, 2);
  scans << 1, 0, near, 5, 1 + near, 9, 1 - apart, 0;
  const DistinctPoses found = FindDistinctPoses(scans, {0});
  EXPECT_EQ(found.centres, (Eigen::MatrixXd{{0}, {1 - apart}, {1}})) << "by their angles";
  EXPECT_EQ(found.wanted, (Eigen::MatrixXd{{0, 0, 0, 0}, {0, 0, 0, 1}, {0.5, 0, 0.5, 0}}));
}

}  // namespace
}  // namespace kvx
