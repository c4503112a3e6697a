// Examples where their scans hide tissue: as the others lead to expect, and the same as if left out.
#include "pipeline/examples/complete_example.h"

#include <gtest/gtest.h>

#include "pipeline/artifacts/held.h"
#include "pipeline/examples/compute_example.h"
#include "pipeline/examples/expected_example.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// One joint with one degree of freedom.
SkeletonFit HingeAt(const std::vector<double>& degrees) {
  SkeletonFit fit;
  fit.skeleton.joints = {Joint{.child = 0, .parent = kNoParent}, Joint{.child = 1, .parent = 0}};
  fit.skeleton.joints[1].dofs.resize(1);
  for (const double d : degrees) fit.scan_angles.push_back(JointAngles::Constant(1, RadFromDeg(d)));
  return fit;
}

constexpr VoxelWeights kNearTip{{1, 1, 1, 1}, {1, 0, 0, 0}};

TEST(ExpectedExample, IsItsOwnWhereTheScanShowsIt) {
  const PoseSpace space(HingeAt({20, 50}));
  const ExamplesAt at{(Eigen::Matrix3Xd(3, 2) << 1, 4, 2, 5, 3, 6).finished(), {100, 100}};
  EXPECT_EQ(ExpectedExample(space, 1).At(kNearTip, at), Eigen::Vector3d(4, 5, 6));
}

// Interpolation through what is expected is interpolation without it.
TEST(ExpectedExample, AScanThatShowsNothingChangesNoPose) {
  const PoseSpace others(HingeAt({20, 50, 80}));
  const PoseSpace all = others.With(JointAngles::Constant(1, RadFromDeg(65)));
  ExamplesAt at{Eigen::Matrix3Xd::Random(3, 4), {100, 100, 100, 0}};
  at.mm.col(3) = ExpectedExample(all, 3).At(kNearTip, at);
  for (const double degrees : {10, 35, 64, 65, 66, 75}) {
    const JointAngles pose = JointAngles::Constant(1, RadFromDeg(degrees));
    const Eigen::Vector3d with = at.mm * all.Coefficients(pose).row(1).transpose(),
                          without = at.mm.leftCols(3) * others.Coefficients(pose).row(1).transpose();
    EXPECT_LT((with - without).norm(), 1e-9) << degrees;
  }
}

TEST(ExpectedExample, NobodyKnowsAnythingWhereNoScanShowsIt) {
  const PoseSpace space(HingeAt({20, 50}));
  const ExamplesAt at{Eigen::Matrix3Xd::Constant(3, 2, 7), {0, 0}};
  EXPECT_EQ(ExpectedExample(space, 0).At(kNearTip, at), Eigen::Vector3d(0, 0, 0)) << "as the bones move it";
}

TEST(ExpectedExample, WhatIsHalfKnownIsHalfItsOwn) {
  const PoseSpace space(HingeAt({20, 50}));
  ExamplesAt at{(Eigen::Matrix3Xd(3, 2) << 1, 4, 2, 5, 3, 6).finished(), {100, 0}};
  const Eigen::Vector3d expected = ExpectedExample(space, 1).At(kNearTip, at);
  at.shown_percent[1] = 50;
  EXPECT_LT((ExpectedExample(space, 1).At(kNearTip, at) - 0.5 * (expected + at.mm.col(1))).norm(), 1e-12);
}

// A body of two halves, of which the second scan shows the first.
struct HalfHidden {
  HalfHidden() {
    const Grid grid = ObliqueGrid({24, 12, 10});
    Mask drawn(grid), shown(grid), all(grid);
    WeightMap near_tip(grid);
    DisplacementField mm(grid);
    for (size_t v = 0; v < drawn.values.size(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v);
      drawn.values[v] = p.x() >= 4 && p.x() < 20 && p.y() >= 4 && p.y() < 8 && p.z() >= 3 && p.z() < 7;
      all.values[v] = drawn.values[v] ? 100 : 0;
      shown.values[v] = p.x() < 12 ? all.values[v] : 0;
      near_tip.values[v] = kNearTip;
      mm.values[v] = Eigen::Vector3f(float(p.x()), 1, float(p.z()));
    }
    body = Held(drawn), weights = Held(near_tip);
    fields = {mm, mm};
    for (Eigen::Vector3f& d : fields[1].values) d = Eigen::Vector3f(9, -9, 9);
    masks = {all, shown};
    fit = Held(HingeAt({20, 50}));
    moments = Held(ExampleMoments{});
    for (size_t k = 0; k < 2; ++k) {
      scans.push_back({{},
                       {},
                       [this, k] { return std::make_shared<DisplacementField>(fields[k]); },
                       [this, k] { return std::make_shared<Mask>(masks[k]); }});
    }
  }
  DisplacementField Completed(int scan) {
    ExampleStack stack(body, scans);
    StageContext context{SharedBackend(), {}};
    return CompleteExample::Run({stack, body, weights, fit, moments}, {scan}, context);
  }
  Artifact<Mask> body{{}, nullptr};
  Artifact<WeightMap> weights{{}, nullptr};
  Artifact<SkeletonFit> fit{{}, nullptr};
  Artifact<ExampleMoments> moments{{}, nullptr};
  std::vector<DisplacementField> fields;
  std::vector<Mask> masks;
  std::vector<ExampleStack::Scan> scans;
};

TEST(CompleteExample, IsTheScansOwnWhereItIsShownAndExpectedElsewhere) {
  HalfHidden world;
  const DisplacementField out = world.Completed(1);
  const PoseSpace space(*world.fit);
  const double c = space.CoefficientsOfOthers(1, 1, Eigen::Vector2d(1, 0))[0];
  ASSERT_GT(c, 1) << "the second scan bends farther";
  EXPECT_EQ(out(6, 5, 5), Eigen::Vector3f(9, -9, 9));
  EXPECT_LT((out(15, 5, 5) - float(c) * world.fields[0](15, 5, 5)).norm(), 1e-4);
  EXPECT_EQ(world.Completed(0).values, world.fields[0].values) << "all of it is shown";
}

TEST(CompleteExample, GoesOnAroundTheBody) {
  HalfHidden world;
  const DisplacementField out = world.Completed(1);
  const Grid& grid = out.grid;
  EXPECT_EQ(out(6, 3, 5), Eigen::Vector3f(9, -9, 9));
  for (int away = 1; away < 4; ++away) {  // from the body's side, y = 4
    const double mm = away * grid.spacing_mm.y();
    EXPECT_LT((out(15, 4 - away, 5) - float(ExampleFade(mm)) * out(15, 4, 5)).norm(), 1e-4) << away;
  }
}

TEST(ExampleStack, LooksOnceAndAgainWhenForgotten) {
  HalfHidden world;
  int loads = 0;
  const auto load = world.scans[0].load_example;
  world.scans[0].load_example = [&] { return ++loads, load(); };
  ExampleStack stack(world.body, world.scans);
  EXPECT_EQ(loads, 0);
  EXPECT_EQ(stack.AtBodyVoxels()[1].mm.size(), stack.BodyVoxels().size());
  EXPECT_EQ(stack.BodyVoxels().size(), 16u * 4 * 4);
  EXPECT_EQ(loads, 1);
  stack.Forget();
  EXPECT_EQ(stack.AtBodyVoxels()[0].mm[0], world.fields[0](4, 4, 3));
  EXPECT_EQ(loads, 2);
}

}  // namespace
}  // namespace kvx
