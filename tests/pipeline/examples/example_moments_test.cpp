// Second moments of examples: means by weight, and what is left without one scan.
#include "pipeline/examples/example_moments.h"

#include <gtest/gtest.h>

#include "pipeline/artifacts/held.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(SpreadVoxels, AreOfTheBodyAndEvenlySpread) {
  Mask body(ObliqueGrid());
  for (size_t v = 100; v < 900; ++v) body.values[v] = 1;
  EXPECT_EQ(SpreadVoxels(body, 2000).size(), 800u) << "all of them";
  const std::vector<size_t> some = SpreadVoxels(body, 300);
  ASSERT_EQ(some.size(), 267u) << "every third";
  for (size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i], 100 + 3 * i);
  EXPECT_TRUE(SpreadVoxels(Mask(ObliqueGrid()), 10).empty());
}

// Two body voxels, of bones 0 and 1 by 1 : 0 and 1 : 3.
struct TwoVoxels {
  TwoVoxels() {
    body.values[5] = body.values[9] = 1;
    weights.values[5] = {{0, 0, 0, 0}, {1, 0, 0, 0}};
    weights.values[9] = {{1, 0, 0, 0}, {0.75f, 0.25f, 0, 0}};
  }
  ExampleSample Sample(const Eigen::Vector3f& at_5, const Eigen::Vector3f& at_9) const {
    DisplacementField example(body.grid, Eigen::Vector3f::Constant(7));
    example.values[5] = at_5, example.values[9] = at_9;
    StageContext context{SharedBackend(), {}};
    return SampleExample::Run({Held(body), Held(example), Held(Mask(body.grid, 100))}, {}, context);
  }
  ExampleMoments Moments(const std::vector<ExampleSample>& samples) const {
    std::vector<Artifact<ExampleSample>> wrapped;
    for (const auto& sample : samples) wrapped.push_back(Held(sample));
    StageContext context{SharedBackend(), {}};
    return CompareExamples::Run({Held(body), Held(weights), Held(FitOf(samples.size())), wrapped}, {3},
                                context);
  }
  // Three bones without joints
  static SkeletonFit FitOf(size_t scans) {
    SkeletonFit fit;
    for (int b = 0; b < 3; ++b) fit.skeleton.joints.push_back({.child = b, .parent = b - 1});
    fit.scan_angles.assign(scans, JointAngles(0));
    return fit;
  }
  Mask body{ObliqueGrid()};
  WeightMap weights{ObliqueGrid()};
};

TEST(CompareExamples, AveragesProductsByWeight) {
  const TwoVoxels world;
  const ExampleMoments moments =
      world.Moments({world.Sample({3, 0, 0}, {0, 6, 0}), world.Sample({0, 3, 3}, {0, 2, 1})});
  ASSERT_EQ(moments.of_bones.size(), 3u);
  Eigen::Matrix2d at_5, at_9;
  at_5 << 3, 0, 0, 6;         // 9/3, 0; 18/3
  at_9 << 12, 4, 4, 5.0 / 3;  // 36/3, 12/3; 5/3
  EXPECT_TRUE(moments.of_bones[0].isApprox((at_5 + 0.25 * at_9) / 1.25, 1e-12)) << moments.of_bones[0];
  EXPECT_TRUE(moments.of_bones[1].isApprox(at_9, 1e-12)) << moments.of_bones[1];
  EXPECT_EQ(moments.of_bones[2], Eigen::Matrix2d::Zero()) << "a bone without any body";
}

TEST(CompareExamples, LeavesOneScanOut) {
  const TwoVoxels world;
  const auto first = world.Sample({3, 0, 0}, {0, 6, 0}), second = world.Sample({0, 3, 3}, {0, 2, 1}),
             third = world.Sample({1, 1, 0}, {0, 0, 1});
  const ExampleMoments whole = world.Moments({first, second, third}).Without(1),
                       less = world.Moments({first, third});
  for (int bone = 0; bone < 3; ++bone) EXPECT_EQ(whole.of_bones[bone], less.of_bones[bone]);
}

TEST(CompareExamples, ScansThatHideABoneAreNamed) {
  const TwoVoxels world;
  ExampleSample hidden = world.Sample({50, 0, 0}, {0, 6, 0});
  hidden.shown_percent = {0, 0};
  const ExampleMoments moments = world.Moments({world.Sample({0, 3, 3}, {0, 2, 1}), hidden});
  EXPECT_EQ(moments.hidden.col(0), Eigen::Vector3i(0, 0, 0));
  EXPECT_EQ(moments.hidden(0, 1), 1);
  EXPECT_EQ(moments.hidden(1, 1), 1);
  EXPECT_EQ(moments.ShownNear(0, 2), std::vector<int>{0});
  EXPECT_EQ(moments.Without(0).hidden(0, 0), 1);
  EXPECT_TRUE(moments.Without(1).ShownNear(0, 1) == std::vector<int>{0});
}

}  // namespace
}  // namespace kvx
