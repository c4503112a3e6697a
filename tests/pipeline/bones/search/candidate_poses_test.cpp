// How many places are tried for the root: as its thickness asks, and never more than can be kept.
#include "pipeline/bones/search/candidate_poses.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

BoneShape Cube(double edge_mm) {
  BoneShape bone;
  bone.centroid_mm = Eigen::Vector3d::Zero();
  bone.axes = Eigen::Matrix3d::Identity();
  bone.extent_mm.setConstant(edge_mm);
  bone.thickness_mm = bone.length_mm = edge_mm;
  return bone;
}

Grid Cubic(int size, double spacing_mm) {
  Grid grid;
  grid.size.setConstant(size);
  grid.spacing_mm.setConstant(spacing_mm);
  return grid;
}

// A cube turns in steps of 25 degrees. Places 0.4 of its 50 mm apart are 5 along every 100 mm.
TEST(RootCandidates, PlacesAreFourTenthsOfTheThicknessApart) {
  const size_t turns = RotationLattice(RadFromDeg(25), RadFromDeg(75)).size();
  EXPECT_EQ(RootCandidates(Cube(50), Cubic(50, 2.0)).size(), 125 * turns);
}

TEST(RootCandidates, ABoneOfOneVoxelInAWideScanIsSearchedMoreCoarsely) {
  const size_t count = RootCandidates(Cube(1), Cubic(400, 1.0)).size();
  EXPECT_GT(count, size_t(1) << 23);
  EXPECT_LT(count, size_t(9) << 21);  // and what rounding up adds
}

// Two turns have the same places; those of the first in the order of memory, half a step from the sides.
TEST(RootCandidates, EveryTurnIsTriedInEveryPlace) {
  const BoneShape cube = Cube(50);
  const Grid scan = Cubic(51, 2.0);
  const RootCandidates all(cube, scan);
  const size_t places = 216;
  ASSERT_EQ(all.size() % places, 0u);
  const auto centre = [&](size_t n) { return Eigen::Vector3d((all[n] * PointMm{cube.centroid_mm}).lps); };
  EXPECT_NEAR((centre(1) - centre(0) - Eigen::Vector3d(100.0 / 6, 0, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((centre(6) - centre(0) - Eigen::Vector3d(0, 100.0 / 6, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((centre(36) - centre(0) - Eigen::Vector3d(0, 0, 100.0 / 6)).norm(), 0, 1e-9);
  EXPECT_NEAR((centre(places + 77) - centre(77)).norm(), 0, 1e-9);
  EXPECT_GT(all[0].rotation.angularDistance(all[places].rotation), RadFromDeg(10));
}

}  // namespace
}  // namespace kvx
