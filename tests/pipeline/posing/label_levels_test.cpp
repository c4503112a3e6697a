// Levels at which trilinear shares have their voxels' volume: closed forms of plates and rods.
#include "pipeline/posing/label_levels.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {
using namespace testing_support;

LabelMap Drawn(const Eigen::Vector3i& low, const Eigen::Vector3i& high, uint16_t label = 1) {
  LabelMap labels(PlainGrid({12, 10, 8}, {0.5, 1, 2}, {3, -4, 5}));
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const Eigen::Array3i at = labels.grid.Ijk(v).array();
    if ((at >= low.array()).all() && (at < high.array()).all()) labels.values[v] = label;
  }
  return labels;
}

// A plate through the grid has the share 1 - |x|, which is t or more over 2 (1 - t) voxels.
TEST(LabelLevels, OfAPlateIsHalf) {
  EXPECT_NEAR(LabelLevels(Drawn({4, 0, 0}, {5, 10, 8}))[1], 0.5, 0.01);
  EXPECT_NEAR(LabelLevels(Drawn({0, 0, 3}, {12, 10, 6}))[1], 0.5, 0.01);
}

// Of a rod (1 - |x|) (1 - |y|) is t or more over 4 (1 - t (1 - ln t)) voxels, which are to be 1.
TEST(LabelLevels, OfARodIsLess) {
  const double level = LabelLevels(Drawn({4, 5, 0}, {5, 6, 8}))[1];
  EXPECT_NEAR(4 * (1 - level * (1 - std::log(level))), 1, 0.02) << level;
}

TEST(LabelLevels, AreHalfOfWhatFillsTheGridOrIsNotThere) {
  EXPECT_EQ(LabelLevels(Drawn({0, 0, 0}, {12, 10, 8}, 3)), (std::vector<float>{0.5f, 0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(LabelLevels(Drawn({0, 0, 0}, {0, 0, 0})), std::vector<float>{0.5f});
}

}  // namespace
}  // namespace kvx
