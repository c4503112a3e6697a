#include "pipeline/pictures/slice_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kvx {
namespace {

// A bright cube of 20 mm whose middle lies at the origin.
Volume CubeIn(const Eigen::Vector3i& size, double spacing_mm) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm.setConstant(spacing_mm);
  grid.origin.lps = -0.5 * spacing_mm * (size.array() - 1).cast<double>();
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v)
    out.values[v] = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps.cwiseAbs().maxCoeff() < 10 ? 100 : 0;
  return out;
}

// Of the longest row of bright pixels between two columns.
int BrightWidth(Picture& picture, int from, int to) {
  int widest = 0;
  for (int y = 0; y < picture.height; ++y) {
    int width = 0;
    for (int x = from; x < to; ++x) width += picture.At(x, y)[0] > 127;
    widest = std::max(widest, width);
  }
  return widest;
}

TEST(SliceTiles, ALengthHasTheSameWidthInEveryTileOfAPage) {
  const Volume narrow = CubeIn({32, 32, 32}, 1), padded = CubeIn({64, 64, 64}, 1),
               coarse = CubeIn({24, 24, 24}, 2);
  Picture page = SliceMontage({narrow, padded, coarse});
  constexpr int kPixelsOfAMm = 8;  // 256 along the shortest of the three
  const int second = 32 * kPixelsOfAMm + kTileGap, third = second + 64 * kPixelsOfAMm + kTileGap;
  ASSERT_EQ(page.width, third + 48 * kPixelsOfAMm);
  EXPECT_NEAR(BrightWidth(page, 0, second - kTileGap), 20 * kPixelsOfAMm, 2);
  EXPECT_NEAR(BrightWidth(page, second, third - kTileGap), 20 * kPixelsOfAMm, 2);
  EXPECT_NEAR(BrightWidth(page, third, page.width), 20 * kPixelsOfAMm, 2);
}

TEST(SliceTiles, AFineVolumeBesideALargeOneMakesNoHugePage) {
  Grid fine, large;
  fine.size.setConstant(256);
  fine.spacing_mm.setConstant(0.01);
  large.size.setConstant(500);
  EXPECT_EQ(PixelMmOf({fine}), 0.01);
  const double pixel_mm = PixelMmOf({fine, large});
  EXPECT_EQ(PlaneThrough(large, 2, large.Middle(), pixel_mm).width, 4096);
}

}  // namespace
}  // namespace kvx
