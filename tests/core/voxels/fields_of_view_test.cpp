// Boxes that touch, overlap or lie apart, in each other's axes and not.
#include "core/voxels/fields_of_view.h"

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

// A long plate of 2 mm, turned by 45 degrees, that passes a corner of the cube: its corners lie on all sides
// of the cube, but the cube lies on one side of it.
TEST(FieldsOfView, APlateBesideACornerIsApartByItsOwnAxes) {
  const auto plate = [](double from_corner_mm) {
    Grid grid;
    grid.size = {2, 100, 10};
    grid.spacing_mm = {1, 1, 2};
    grid.direction = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d corner(19, 19, 9),
        across = grid.direction.col(0);  // the cube's, at half its height
    grid.origin.lps =
        corner + (1 + from_corner_mm) * across - grid.MmFromVox() * Eigen::Vector3d(0.5, 49.5, 4.5);
    return grid;
  };
  EXPECT_TRUE(FieldsOfViewApart(Cube(0), plate(0.1)));
  EXPECT_TRUE(FieldsOfViewApart(plate(0.1), Cube(0)));
  EXPECT_FALSE(FieldsOfViewApart(Cube(0), plate(-0.1)));
  EXPECT_FALSE(FieldsOfViewApart(plate(-0.1), Cube(0)));
}

}  // namespace
}  // namespace kvx
