// Boxes that touch, overlap or lie apart, in each other's axes and not.
#include "core/fields_of_view.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

Grid Cube(double origin_x) {  // 10 voxels of 2 mm: from half a voxel before its origin on, 20 mm
  Grid grid;
  grid.size = {10, 10, 10};
  grid.spacing_mm = {2, 2, 2};
  grid.origin.lps = {origin_x, 0, 0};
  return grid;
}

TEST(FieldsOfView, ThatShareAVoxelsPartAreNotApart) {
  EXPECT_FALSE(FieldsOfViewApart(Cube(0), Cube(19.9)));
  EXPECT_FALSE(FieldsOfViewApart(Cube(0), Cube(-19.9)));
  EXPECT_FALSE(FieldsOfViewApart(Cube(5), Cube(5)));
}

TEST(FieldsOfView, BesideEachOtherAreApartWhicheverIsAskedFirst) {
  EXPECT_TRUE(FieldsOfViewApart(Cube(0), Cube(20.1)));
  EXPECT_TRUE(FieldsOfViewApart(Cube(20.1), Cube(0)));
}

TEST(FieldsOfView, OneInsideTheOtherIsNotApart) {
  Grid small = Cube(8);
  small.origin.lps = {8, 8, 8};
  small.size = {2, 2, 2};
  EXPECT_FALSE(FieldsOfViewApart(Cube(0), small));
}

// Turned by 45 degrees the second reaches 14.1 mm to either side of its middle, the first 10 mm.
TEST(FieldsOfView, ThatAreTurnedAreJudgedByTheirCorners) {
  const auto turned = [](double middle_x) {
    Grid grid = Cube(0);
    grid.direction = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    grid.origin.lps = Eigen::Vector3d(middle_x, 9, 9) - grid.MmFromVox() * Eigen::Vector3d(4.5, 4.5, 4.5);
    return grid;
  };
  EXPECT_FALSE(FieldsOfViewApart(Cube(0), turned(9 + 24.0)));
  EXPECT_TRUE(FieldsOfViewApart(Cube(0), turned(9 + 24.3)));
}

}  // namespace
}  // namespace kvx
