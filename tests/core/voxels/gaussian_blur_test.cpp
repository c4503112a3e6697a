// A point spreads as the bell curve says; what is even or rises evenly stays.
#include "core/voxels/gaussian_blur.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ObliqueGrid;

TEST(GaussianBlur, APointBecomesTheBellOfEachAxis) {
  Volume volume(ObliqueGrid({21, 17, 15}), 0.0f);
  volume(10, 8, 7) = 1;
  const Eigen::Vector3d deviation(1.4, 0, 0.9);
  GaussianBlur(volume, deviation);
  const auto bell = [&](int steps, int axis) {
    double sum = 0;
    const auto at = [&](int r) { return std::exp(-0.5 * r * r / (deviation[axis] * deviation[axis])); };
    const int reach = int(std::ceil(3 * deviation[axis]));
    for (int r = -reach; r <= reach; ++r) sum += at(r);
    return std::abs(steps) <= reach ? at(steps) / sum : 0.0;
  };
  for (int k = 0; k < 15; ++k) {
    for (int i = 0; i < 21; ++i) EXPECT_NEAR(volume(i, 8, k), bell(i - 10, 0) * bell(k - 7, 2), 1e-7);
  }
  EXPECT_EQ(volume(10, 7, 7), 0) << "an axis without deviation stays";
}

// Row by row of Pascal's triangle; at the border as a line twice as long that is mirrored there.
TEST(BinomialBlur, APointSpreadsAsPascalsTriangleSays) {
  Volume volume(ObliqueGrid({13, 11, 12}), 0.0f);
  volume(6, 0, 5) = 1;
  BinomialBlur(volume, 2);
  const auto weight = [](int steps) {
    constexpr double kRow[] = {6.0 / 16, 4.0 / 16, 1.0 / 16};
    return std::abs(steps) <= 2 ? kRow[std::abs(steps)] : 0.0;
  };
  for (int k = 0; k < 12; ++k) {
    for (int j = 0; j < 11; ++j) {
      for (int i = 0; i < 13; ++i)
        EXPECT_NEAR(volume(i, j, k), weight(i - 6) * (weight(j) + weight(j + 1)) * weight(k - 5), 1e-7);
    }
  }
}

TEST(GaussianBlur, EvenGroundStaysAndSoDoesASlopeAwayFromTheBorder) {
  Volume even(ObliqueGrid({9, 8, 7}), 3.0f), slope(ObliqueGrid({20, 4, 3}));
  GaussianBlur(even, {2, 2, 2});
  for (const float value : even.values) EXPECT_NEAR(value, 3, 1e-5);
  for (size_t v = 0; v < slope.values.size(); ++v) slope.values[v] = float(slope.grid.Ijk(v).x());
  GaussianBlur(slope, {1.5, 1, 1});
  for (int i = 5; i < 15; ++i) EXPECT_NEAR(slope(i, 2, 1), i, 1e-4);
  EXPECT_GT(slope(0, 2, 1), 0) << "the border's value goes on";
}

}  // namespace
}  // namespace kvx
