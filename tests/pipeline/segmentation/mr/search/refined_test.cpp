// A cubic is interpolated exactly; so is a stroke.
#include "pipeline/segmentation/mr/search/refined.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kvx {
namespace {

Grid Oblique() {
  Grid grid;
  grid.size = {7, 6, 5};
  grid.spacing_mm = {1.5, 0.8, 2.0};
  grid.origin = {{-4, 12, 3}};
  grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  return grid;
}

TEST(Refined, AParabolaIsExactAwayFromTheBorderAndPlacesStay) {
  const auto value = [](const Eigen::Vector3d& p) {
    return 3 + 0.5 * p.x() * p.x() - p.y() * p.z() + 2 * p.z();
  };
  Volume volume(Oblique());
  for (size_t v = 0; v < volume.values.size(); ++v)
    volume.values[v] = float(value(volume.grid.Ijk(v).cast<double>()));
  const Volume fine = Refined(volume);
  ASSERT_EQ(fine.grid.size, Eigen::Vector3i(13, 11, 9));
  for (size_t v = 0; v < fine.values.size(); ++v) {
    const Eigen::Vector3i p = fine.grid.Ijk(v);
    const Eigen::Vector3d in_voxels = 0.5 * p.cast<double>();
    const Eigen::Vector3d apart =
        fine.grid.ToMm(PointVox{p.cast<double>()}).lps - volume.grid.ToMm(PointVox{in_voxels}).lps;
    EXPECT_LT(apart.norm(), 1e-9);
    if ((p.array() < 2).any() || (p.array() + 2 >= fine.grid.size.array()).any()) continue;
    EXPECT_NEAR(fine.values[v], value(in_voxels), 1e-4);
  }
  EXPECT_EQ(OnVoxels(fine, volume.grid).values, volume.values);
}

TEST(Refined, AStrokeStaysALineAndTwoBonesStayApart) {
  LabelMap strokes(Oblique());
  strokes(1, 2, 2) = strokes(2, 2, 2) = 4;
  strokes(3, 2, 2) = 5;
  const LabelMap fine = Refined(strokes);
  EXPECT_EQ(fine(2, 4, 4), 4);
  EXPECT_EQ(fine(3, 4, 4), 4);
  EXPECT_EQ(fine(4, 4, 4), 4);
  EXPECT_EQ(fine(5, 4, 4), 0);
  EXPECT_EQ(fine(6, 4, 4), 5);
  EXPECT_EQ(std::ranges::count_if(fine.values, [](uint16_t label) { return label != 0; }), 4);
}

}  // namespace
}  // namespace kvx
