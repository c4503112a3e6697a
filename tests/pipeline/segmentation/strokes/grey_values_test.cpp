// Scans and label maps are told apart whatever their size, and however many numbers they hold.
#include "pipeline/segmentation/strokes/grey_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/errors.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "tests/support/plain_grid.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

const Grid kGrid = testing_support::PlainGrid({40, 40, 40}, {1, 1, 1}, {0, 0, 0});

// A ball of tissue in air of 0, with noise as a scan of so many greys has it.
LabelMap ScanOf(int greys, double radius_vox) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.04);
  LabelMap scan(kGrid);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d from_middle = kGrid.Ijk(v).cast<double>() - Eigen::Vector3d::Constant(20);
    if (from_middle.norm() > radius_vox) continue;
    const double share = 0.5 + 0.3 * std::sin(from_middle.x() / 4) + noise(random);
    scan.values[v] = uint16_t(std::clamp(share, 0.0, 1.0) * (greys - 1));
  }
  return scan;
}

// Lines of a voxel's width, one a bone, as far from each other as that many can be.
LabelMap StrokesOf(int bones) {
  LabelMap strokes(kGrid);
  for (int b = 0; b < bones; ++b) {
    for (int i = 4; i < 16; ++i)
      strokes(i + 20 * (b % 2), 2 + 2 * (b / 2 % 18), 2 + 2 * (b / 36)) = uint16_t(b + 1);
  }
  return strokes;
}

TEST(GreyValues, AScanIsKnownWhateverItsGreys) {
  for (const int greys : {32, 200, 4096, 65536}) {
    EXPECT_TRUE(HoldsGreys(ScanOf(greys, 50))) << greys;
    EXPECT_TRUE(HoldsGreys(ScanOf(greys, 12))) << greys << ", most voxels are air";
  }
}

TEST(GreyValues, StrokesOfManyBonesAreNone) {
  for (const int bones : {1, 3, 250, 600}) EXPECT_FALSE(HoldsGreys(StrokesOf(bones))) << bones;
}

TEST(GreyValues, StrokesInAPaintedBackgroundAreNone) {
  LabelMap strokes = StrokesOf(12);
  for (uint16_t& label : strokes.values) label = label == 0 ? kBackgroundStroke : label;
  EXPECT_FALSE(HoldsGreys(strokes));
}

TEST(GreyValues, SinglePointsAreNone) {
  LabelMap strokes(kGrid);
  for (int b = 0; b < 100; ++b) strokes(4 * (b % 10), 4 * (b / 10), 20) = uint16_t(b + 1);
  EXPECT_FALSE(HoldsGreys(strokes));
}

// Thin layers one on the other, as cartilage is drawn.
TEST(GreyValues, LabelsThatTouchAreNone) {
  LabelMap labels(kGrid);
  for (size_t v = 0; v < labels.values.size(); ++v) labels.values[v] = uint16_t(1 + kGrid.Ijk(v).z() / 2);
  EXPECT_FALSE(HoldsGreys(labels));
}

TEST(GreyValues, AScanIsRefusedAsStrokes) {
  const LabelMap scan = ScanOf(200, 50);
  EXPECT_THAT(testing_support::RefusalOf<InputError>([&] { CarriedStrokes(scan, kGrid); }),
              testing::AllOf(testing::HasSubstr("greys"), testing::HasSubstr("255 for the background")));
}

}  // namespace
}  // namespace kvx
