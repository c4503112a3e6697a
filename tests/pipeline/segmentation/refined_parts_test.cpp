// Balls with known borders: parts that are wrong there, right in the middle.
#include "pipeline/segmentation/refined_parts.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr double kLevelHu = 300;

Grid SmallGrid() {
  Grid grid;
  grid.size = {46, 30, 28};
  grid.spacing_mm = {1.0, 1.1, 1.0};
  return grid;
}

double ToBallMm(const Grid& grid, size_t v, double x_mm, double radius_mm) {
  const Eigen::Vector3d mm = grid.Ijk(v).cast<double>().cwiseProduct(grid.spacing_mm);
  return (mm - Eigen::Vector3d(x_mm, 16, 14)).norm() - radius_mm;
}

// Dense shells around marrow in muscle, 1.5 mm apart, and air.
struct Balls {
  Volume scan{SmallGrid()};
  LabelMap truth{SmallGrid()};
  Balls() {
    for (size_t v = 0; v < scan.values.size(); ++v) {
      const double small = ToBallMm(scan.grid, v, 11.5, 7), large = ToBallMm(scan.grid, v, 29, 9);
      const double d = std::min(small, large);
      scan.values[v] = scan.grid.Ijk(v).y() < 2 ? -1000.0f : d > 0 ? 40.0f : d > -2.5 ? 600.0f : 60.0f;
      truth.values[v] = small < 0 ? 2 : large < 0 ? 1 : 0;
    }
  }
};

TEST(RefinedParts, BordersMoveToWhereTheDensityFallsAndTheLargestComesFirst) {
  const Balls balls;
  LabelMap parts(balls.scan.grid);  // 1.2 mm too thick and numbered the other way round; the small one takes
  for (size_t v = 0; v < parts.values.size(); ++v) {  // a slice of the large one
    if (ToBallMm(parts.grid, v, 29, 9) < 1.2) parts.values[v] = 2;
    if (parts.grid.Ijk(v).x() < 22 && ToBallMm(parts.grid, v, 11.5, 7) < 4) parts.values[v] = 1;
  }
  const LabelMap refined = RefinedParts(balls.scan, parts, kLevelHu, {});
  size_t wrong = 0, before = 0, bone = 0;
  for (size_t v = 0; v < parts.values.size(); ++v) {
    bone += balls.truth.values[v] != 0;
    wrong += refined.values[v] != balls.truth.values[v];
    before += (parts.values[v] != 0) != (balls.truth.values[v] != 0);
  }
  EXPECT_GT(double(before), 0.3 * double(bone)) << "the parts are bad enough to tell";
  EXPECT_LT(double(wrong), 0.03 * double(bone));
}

// A head of 20 mm at the end of a shaft of 8: half as deep as the head's middle the shaft is nowhere.
TEST(RefinedParts, AThinShaftStaysWithItsThickEnd) {
  Grid grid;
  grid.size = {36, 36, 108};
  grid.spacing_mm.setConstant(1.5);
  Volume scan(grid);
  LabelMap truth(grid);
  size_t bone = 0;
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d mm = 1.5 * grid.Ijk(v).cast<double>() - Eigen::Vector3d(27, 27, 30);
    const double shaft = std::max(mm.head<2>().norm() - 8, std::max(-mm.z(), mm.z() - 120));
    const double d = std::min(mm.norm() - 20, shaft);
    scan.values[v] = grid.Ijk(v).y() < 2 ? -1000.0f : d > 0 ? 50.0f : d > -3 ? 900.0f : -60.0f;
    bone += truth.values[v] = d < 0;
  }
  const LabelMap refined = RefinedParts(scan, truth, kLevelHu, {});
  size_t kept = 0;
  for (size_t v = 0; v < truth.values.size(); ++v) kept += truth.values[v] && refined.values[v] == 1;
  EXPECT_GT(double(kept), 0.97 * double(bone));
}

TEST(RefinedParts, PartsBeyondTheNumbersOfStrokesStayAsTheyAre) {
  const Balls balls;
  LabelMap parts = balls.truth;
  const size_t lone = parts.grid.Index(42, 27, 25);
  parts.values[lone] = 300;
  const LabelMap refined = RefinedParts(balls.scan, parts, kLevelHu, {});
  EXPECT_EQ(refined.values[lone], 3) << "the smallest of three";
}

}  // namespace
}  // namespace kvx
