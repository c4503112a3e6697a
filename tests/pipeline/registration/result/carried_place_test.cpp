// Rows of blocks of which one shows where it lies.
#include "pipeline/registration/result/carried_place.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kvx {
namespace {

constexpr double kOfOpen = 0.1, kOfBend = 0.1, kOfWay = 0.3;  // the parts that count

struct Row {
  explicit Row(int length) {
    Grid grid;
    grid.size = {length, 1, 1};
    slopes = Image<SharedSlopes>(grid);
    moved_mm = Image<Eigen::Vector3f>(grid);
  }
  // The block's place is known to so many mm^2 along every axis.
  void Show(int block, const Eigen::Vector3d& variances_mm2) {
    slopes(block, 0, 0) = {variances_mm2.cwiseInverse().asDiagonal(), Eigen::Vector3d::Zero(),
                           Eigen::Vector3d::Zero(), 1};
  }
  // The way grows by so much from block to block.
  void Shear(double mm) {
    for (int i = 0; i < moved_mm.grid.size.x(); ++i) moved_mm(i, 0, 0) = {0, 0, float(mm * i)};
  }
  std::vector<float> Variances() const { return CarriedVariancesMm2(slopes, moved_mm).values; }

  Image<SharedSlopes> slopes;
  Image<Eigen::Vector3f> moved_mm;
};

TEST(CarriedVariances, OfABlockThatShowsItsPlaceAreAPartOfItsOwn) {
  Row row(5);
  for (int i = 0; i < 5; ++i)
    row.Show(i, {1, 2, 4}), row.moved_mm(i, 0, 0) = {i % 2 ? 100.0f : -100.0f, 0, 0};
  for (const float variance : row.Variances()) EXPECT_NEAR(variance, kOfOpen * (1 + 2 + 4), 1e-5);
}

// Where blocks all move alike, what their cubes show together counts for each.
TEST(CarriedVariances, OfBlocksThatMoveAlikeAreThoseOfTheWidestCube) {
  Row row(4);
  row.moved_mm = Image<Eigen::Vector3f>(row.moved_mm.grid, Eigen::Vector3f(10, 10, 10));
  for (int i = 0; i < 4; ++i) row.Show(i, {4, 4, 4});
  for (const float variance : row.Variances()) EXPECT_NEAR(variance, kOfOpen * 3, 1e-5);
}

// Every block moves 10 mm farther than the one before, along one axis of three, so that a block as far from
// what shows its place has moved by (10 mm apart)^2 / 3 along each; nothing bends.
TEST(CarriedVariances, GrowWithTheWayToWhatShowsItsPlace) {
  Row row(40);
  row.Shear(10);
  row.Show(0, {1, 1, 1});
  const std::vector<float> variances = row.Variances();
  for (int i = 0; i < 9; ++i)
    EXPECT_NEAR(variances[size_t(i)], 3 * kOfOpen + kOfWay * 100 * i * i, 1e-2) << i;
}

// Beyond every cube nothing is known but how far tissue moves in this scan at all: the mean square of the
// way.
TEST(CarriedVariances, WhereNothingShowsAnyPlaceAreThoseOfTheWay) {
  Row row(20);
  row.Shear(10);
  row.Show(0, {1, 1, 1});
  double mean = 0;
  for (int i = 0; i < 20; ++i) mean += 100.0 * i * i / 20;
  const std::vector<float> variances = row.Variances();
  for (int i = 9; i < 20; ++i) EXPECT_NEAR(variances[size_t(i)], kOfWay * mean, 1e-2) << i;
}

// In the middle between two that show their place a block has moved as both have on average, but for bends:
// of a way that is 3 mm in every other block the mean of both neighbours is 3 mm off.
TEST(CarriedVariances, BetweenBlocksThatShowTheirPlaceAreThoseOfBends) {
  Row row(3);
  for (int i = 0; i < 3; ++i) row.moved_mm(i, 0, 0) = {0, i == 1 ? 23.0f : 20.0f, 0};
  row.Show(0, {1, 1, 1});
  row.Show(2, {1, 1, 1});
  EXPECT_NEAR(row.Variances()[1], 3 * (kOfOpen / 2 + kOfBend * 9 / 3), 1e-5);
}

// As of an edge, along which tissue may lie anywhere.
TEST(CarriedVariances, AlongAxesThatAreNotShownAreThoseOfTheWay) {
  Row row(1);
  row.moved_mm(0, 0, 0) = {10, 0, 0};
  row.slopes(0, 0, 0) = {Eigen::Vector3d(1, 0, -0.5).asDiagonal(), Eigen::Vector3d::Zero(),
                         Eigen::Vector3d::Zero(), 1};
  EXPECT_NEAR(row.Variances()[0], kOfOpen + 2 * kOfWay * 100 / 3, 1e-5);
}

TEST(CarriedVariances, TakeTheWayOfTheBodyAlone) {
  Row row(4);
  const float none = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 4; ++i) row.moved_mm(i, 0, 0) = {i < 2 ? 6.0f : none, 0, 0};
  for (const float variance : row.Variances()) EXPECT_NEAR(variance, kOfWay * 36, 1e-5);
  row.moved_mm = Image<Eigen::Vector3f>(row.moved_mm.grid, Eigen::Vector3f(none, none, none));
  for (const float variance : row.Variances()) EXPECT_EQ(variance, 0) << "no body";
}

}  // namespace
}  // namespace kvx
