// A bone that turns in tissue that stands still: rigid out to its border, continuous beyond, and back again.
#include "pipeline/registration/result/bordered_field.h"

#include <gtest/gtest.h>

#include "pipeline/registration/result/inverse_map.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

// A bar of 6 x 4 x 4 voxels, turned by 8 degrees about its middle and moved by half a voxel.
struct TurnedBar {
  Grid grid = testing_support::ObliqueGrid({16, 14, 12});
  BoneSet bones;
  RigidTransform turn;
  DisplacementField field{grid};

  TurnedBar() {
    bones.bones = {{.label = 5, .name = "bar"}};
    bones.labels = LabelMap(grid);
    turn = RotationAbout(Middle(), Eigen::Vector3d(1, 2, -1).normalized(), RadFromDeg(8));
    turn.translation_mm += 0.5 * grid.MmFromVox().col(0);
    for (size_t v = 0; v < field.values.size(); ++v) {
      const Eigen::Array3i from_low = grid.Ijk(v).array() - Eigen::Array3i(5, 5, 4);
      const bool bone = (from_low >= 0).all() && (from_low < Eigen::Array3i(6, 4, 4)).all();
      bones.labels.values[v] = bone ? 5 : 0;
      const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
      field.values[v].setZero();
      if (bone) field.values[v] = ((turn * x).lps - x.lps).cast<float>();
    }
  }
  PointMm Middle() const { return grid.ToMm(PointVox{{7.5, 6.5, 5.5}}); }
  PointMm At(double i, double j, double k) const { return grid.ToMm(PointVox{{i, j, k}}); }
  BorderedField Carried() const { return {field, bones, {turn}}; }
};

TEST(BorderedField, MovesABoneRigidlyOutToItsBorder) {
  const TurnedBar bar;
  const BorderedField carried = bar.Carried();
  for (const PointMm& x : {bar.At(7.2, 6.1, 5.7), bar.At(10.49, 6.5, 5.5), bar.At(4.51, 6.5, 5.5),
                           bar.At(7, 8.49, 5), bar.At(7, 7, 3.51)})
    EXPECT_LT((carried(x) - (bar.turn * x).lps).norm(), 1e-4);
}

TEST(BorderedField, StandsStillBesideIt) {
  const TurnedBar bar;
  const BorderedField carried = bar.Carried();
  for (const PointMm& x : {bar.At(11, 6.5, 5.5), bar.At(12.3, 6.5, 5.5), bar.At(2, 2, 2), bar.At(-3, 6, 20)})
    EXPECT_LT((carried(x) - x.lps).norm(), 1e-6);
}

TEST(BorderedField, LeavesTissueItsTrilinearPart) {
  const TurnedBar bar;
  const BorderedField carried = bar.Carried();
  for (const double part : {0.3, 0.2, 0.1}) {
    const PointMm x = bar.At(11 - part, 6.5, 5.5);
    const Eigen::Vector3d expected = part * (bar.turn * x).lps + (1 - part) * x.lps;
    EXPECT_LT((carried(x) - expected).norm(), 1e-4) << part;
  }
}

TEST(BorderedField, IsContinuousThroughTheBorder) {
  const TurnedBar bar;
  const BorderedField carried = bar.Carried();
  const double step_mm = 0.01 * bar.grid.spacing_mm.maxCoeff();
  const Eigen::Vector3d apart = (bar.turn * bar.At(11, 7.3, 5.2)).lps - bar.At(11, 7.3, 5.2).lps;
  Eigen::Vector3d before = carried(bar.At(9, 7.3, 5.2));
  for (double i = 9.01; i < 13; i += 0.01) {
    const Eigen::Vector3d now = carried(bar.At(i, 7.3, 5.2));
    EXPECT_LT((now - before).norm(), step_mm + 0.05 * apart.norm()) << i;  // at most 0.04 of it
    before = now;
  }
}

TEST(BorderedField, KeepsWhatAMethodMakesOfBone) {
  TurnedBar bar;
  for (size_t v = 0; v < bar.field.values.size(); ++v)
    if (bar.bones.labels.values[v]) bar.field.values[v] += Eigen::Vector3f(0, 0, 1);
  const PointMm x = bar.At(7.2, 6.1, 5.7);
  EXPECT_LT((bar.Carried()(x) - (bar.turn * x).lps - Eigen::Vector3d(0, 0, 1)).norm(), 1e-4);
}

TEST(BorderedField, IsFollowedBack) {
  const TurnedBar bar;
  const BorderedField carried = bar.Carried();
  const Mask body(bar.grid, 1);
  const InverseMap template_from_scan(carried, body, bar.grid);
  for (const PointMm& x :
       {bar.At(7.2, 6.1, 5.7), bar.At(10.4, 6.5, 5.5), bar.At(10.8, 6.5, 5.5), bar.At(12, 9, 8)}) {
    const auto found = template_from_scan({carried(x)});
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((carried(*found) - carried(x)).norm(), 0.01) << "one of the places that come there";
  }
}

}  // namespace
}  // namespace kvx
