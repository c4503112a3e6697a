// How many places are tried for the root: as its thickness asks, and never more than can be kept.
#include "pipeline/bones/candidate_poses.h"

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
  EXPECT_LT(count, size_t(9) << 21);  // a GiB, and what rounding up adds
}

}  // namespace
}  // namespace kvx
