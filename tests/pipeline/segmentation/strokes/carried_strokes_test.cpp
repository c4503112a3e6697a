// Strokes on the scan's grid, on finer and coarser ones, and in the wrong place.
#include "pipeline/segmentation/strokes/carried_strokes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

Grid Oblique(const Eigen::Vector3i& size, double spacing_mm) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = {spacing_mm, 1.5 * spacing_mm, spacing_mm};
  grid.origin.lps = {-12, 40, 7};
  grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 2).normalized()).toRotationMatrix();
  return grid;
}

std::string RefusalOf(const LabelMap& strokes, const Grid& scan, bool background_suffices = false) {
  return testing_support::RefusalOf<InputError>([&] { CarriedStrokes(strokes, scan, background_suffices); });
}

TEST(CarriedStrokes, NoMarkIsLostOnACoarserGrid) {
  LabelMap fine(Oblique({40, 40, 40}, 0.5));
  for (int n = 3; n < 30; ++n) fine(n, n, n) = uint16_t(n);
  const Grid coarse = Oblique({20, 20, 20}, 1.0);
  const LabelMap carried = CarriedStrokes(fine, coarse);
  for (int n = 4; n < 30; n += 2)
    EXPECT_EQ(carried(n / 2, n / 2, n / 2), n) << "even voxels share their centres";
  EXPECT_EQ(CarriedStrokes(fine, fine.grid).values, fine.values);
}

TEST(CarriedStrokes, RefusesWhatLiesElsewhere) {
  const Grid scan = Oblique({20, 20, 20}, 1.0);
  LabelMap strokes(scan);
  EXPECT_THAT(RefusalOf(strokes, scan), testing::HasSubstr("mark no bone"));
  strokes(3, 3, 3) = kBackgroundStroke;
  EXPECT_THAT(RefusalOf(strokes, scan), testing::HasSubstr("mark no bone"));
  strokes(5, 5, 5) = 2;
  EXPECT_EQ(RefusalOf(strokes, scan), "");
  LabelMap shifted = strokes;
  shifted.grid.origin.lps.x() += 4;
  EXPECT_THAT(RefusalOf(shifted, scan), testing::HasSubstr("another place"));
  LabelMap larger(Oblique({60, 20, 20}, 1.0));
  larger(5, 5, 5) = 1, larger(50, 5, 5) = 2;
  EXPECT_THAT(RefusalOf(larger, scan), testing::HasSubstr("bone 2 lie outside"));
}

TEST(CarriedStrokes, BackgroundAloneIsTakenWhereItSuffices) {
  const Grid scan = Oblique({20, 20, 20}, 1.0);
  LabelMap strokes(scan);
  EXPECT_THAT(RefusalOf(strokes, scan, true), testing::HasSubstr("mark no bone")) << "nothing is marked";
  strokes(3, 3, 3) = kBackgroundStroke;
  EXPECT_EQ(RefusalOf(strokes, scan, true), "");
  LabelMap larger(Oblique({60, 20, 20}, 1.0));
  larger(50, 5, 5) = kBackgroundStroke;
  EXPECT_THAT(RefusalOf(larger, scan, true), testing::HasSubstr("outside"));
}

TEST(CarriedStrokes, TheSameImageWithFlippedAxesIsNotElsewhere) {
  const Grid scan = Oblique({20, 20, 20}, 1.0);
  Grid flipped = scan;
  flipped.origin = scan.ToMm(19, 0, 0);
  flipped.direction.col(0) *= -1;
  LabelMap strokes(flipped);
  strokes(4, 6, 7) = 3;
  EXPECT_EQ(CarriedStrokes(strokes, scan)(15, 6, 7), 3);
}

}  // namespace
}  // namespace kvx
