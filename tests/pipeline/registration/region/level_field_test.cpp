// The map of a registration on the template's whole grid, and where it folds.
#include "pipeline/registration/region/level_field.h"

#include <gtest/gtest.h>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// A small body in the middle of a large grid, turned by 30 degrees, and shifted by 1 mm by the images.
TEST(OnTemplate, BeyondTheRegionTheBonesMotionGoesOn) {
  const Grid grid = ObliqueGrid({64, 60, 56});
  Mask body(grid);
  body(32, 30, 28) = 1;
  const WorkRegion region = RegionAround(body);
  ASSERT_LT(region.grid.size.maxCoeff(), 50) << "there is a beyond";
  VoxelWeights rigid;
  rigid.weights[0] = 1;
  const RigidTransform turn = RotationAbout(grid.ToMm(32, 30, 28), {1, 2, 3}, RadFromDeg(30));
  const Eigen::Vector3d shift(0.6, 0, -0.8);
  std::vector<Eigen::Vector3f> scan_mm(region.grid.VoxelCount());
  for (size_t v = 0; v < scan_mm.size(); ++v) {
    const PointMm x = region.grid.ToMm(PointVox{region.grid.Ijk(v).cast<double>()});
    scan_mm[v] = ((turn * x).lps + shift).cast<float>();
  }
  const DisplacementField field = OnTemplate(WeightMap(grid, rigid), {turn}, region, scan_mm);
  for (const Eigen::Vector3i& p : {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(63, 59, 55),
                                   Eigen::Vector3i(32, 30, 28), Eigen::Vector3i(0, 30, 55)}) {
    const PointMm x = grid.ToMm(p.x(), p.y(), p.z());
    const Eigen::Vector3d there = x.lps + field(p.x(), p.y(), p.z()).cast<double>();
    EXPECT_LT((there - (turn * x).lps - shift).norm(), 1e-3) << p.transpose();
  }
}

// A start that is linear goes on as it began: where a voxel comes from the place a field says, it goes to
// what the start makes of that place.
TEST(StartAfter, IsTheStartOfWhereTheFieldPoints) {
  WorkRegion region;
  region.grid = ObliqueGrid({8, 9, 7});
  const RigidTransform start = RotationAbout(PointMm{{1, 2, 3}}, {1, 0, 2}, 0.3);
  const auto place = [&](size_t v) { return region.grid.ToMm(PointVox{region.grid.Ijk(v).cast<double>()}); };
  std::vector<Eigen::Vector3f> start_mm;
  std::vector<FieldVector> field(region.grid.VoxelCount(), FieldVector::Zero());
  for (size_t v = 0; v < field.size(); ++v) {
    start_mm.push_back((start * place(v)).lps.cast<float>());
    const bool inner = (region.grid.Ijk(v).array() > 0).all() &&
                       (region.grid.Ijk(v).array() < region.grid.size.array() - 1).all();
    if (inner && v % 3) field[v].head<3>() << 0.3f, -0.2f, 0.1f;
  }
  const std::vector<Eigen::Vector3f> after_mm = StartAfter(start_mm, region, field);
  for (size_t v = 0; v < field.size(); ++v) {
    const PointMm from{place(v).lps + field[v].head<3>().cast<double>()};
    EXPECT_LT((after_mm[v].cast<double>() - (start * from).lps).norm(), 1e-4) << v;
  }
}

// x + u(x) = A x with a determinant of `stretch`: how far it is compressed does not matter, that it is turned
// inside out does.
TEST(FoldedFraction, CountsWhatIsTurnedInsideOut) {
  const Grid grid = ObliqueGrid();
  const auto folded = [&](double stretch) {
    DisplacementField field(grid, Eigen::Vector3f::Zero());
    for (size_t v = 0; v < field.values.size(); ++v) {
      const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
      field.values[v] = Eigen::Vector3d(0, 0, (stretch - 1) * x.z()).cast<float>();
    }
    return FoldedFraction(field, Mask(grid, 1));
  };
  EXPECT_EQ(folded(0.2), 0);
  EXPECT_EQ(folded(-0.2), 1);
}

}  // namespace
}  // namespace kvx
