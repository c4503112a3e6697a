// Posing against closed forms: identity, rigid motion, and the agreement of the posed volume with the mapped
// points.
#include "pipeline/posing/posing_engine.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;

std::vector<PointMm> BodyPoints(const HingeWorld& world, double inset_mm, int stride = 3) {
  std::vector<PointMm> points;
  for (size_t v = 0; v < world.body.values.size(); v += stride) {
    const PointMm x = world.body.grid.ToMm(PointVox{world.body.grid.Ijk(v).cast<double>()});
    if (world.DeepInside(x, inset_mm)) points.push_back(x);
  }
  return points;
}

// Mean and greatest |posed(M(x)) - template(x)|.
std::pair<double, double> Disagreement(const HingeWorld& world, const PosingEngine& engine,
                                       const ResolvedPose& pose, const Volume& posed) {
  const std::vector<PointMm> points = BodyPoints(world, 2.0), mapped = engine.MapPoints(pose, points);
  double sum = 0, most = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const float at = SampleTrilinear(posed, posed.grid.ToVox(mapped[i]), -1000);
    const double error = std::abs(at - world.TextureAt(points[i]));
    sum += error, most = std::max(most, error);
  }
  return {sum / double(points.size()), most};
}

TEST(PosingEngine, TheIdentityGivesTheTemplateBack) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const PosedVolume posed = engine.Pose(world.Posed(world.Bent(0)));
  ASSERT_TRUE(posed.volume.grid == world.body.grid);
  EXPECT_EQ(posed.folded_fraction, 0);
  for (size_t v = 0; v < posed.volume.values.size(); ++v) {
    ASSERT_NEAR(posed.volume.values[v], world.scan.volume.values[v], 2e-3) << "voxel " << v;
  }
}

TEST(PosingEngine, ARigidMotionOfAllBonesMovesTheTextureRigidly) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const RigidTransform motion = Exp((Twist() << 0.3, -0.35, 0.2, 4, 3, -2).finished());
  const ResolvedPose pose = world.Posed({motion, motion});
  const PosedVolume posed = engine.Pose(pose);
  size_t inside = 0;
  for (size_t v = 0; v < posed.volume.values.size(); ++v) {
    const PointMm x =
        motion.Inverse() * posed.volume.grid.ToMm(PointVox{posed.volume.grid.Ijk(v).cast<double>()});
    if (!world.DeepInside(x, 2)) {
      if (!world.DeepInside(x, -6)) {
        ASSERT_EQ(posed.volume.values[v], HingeWorld::kAir);
      }
      continue;
    }
    ++inside;
    const float oracle = SampleTrilinear(world.scan.volume, world.body.grid.ToVox(x));
    ASSERT_NEAR(posed.volume.values[v], oracle, 0.02) << "voxel " << v;
  }
  EXPECT_GT(inside, 3000u);  // the whole bar lies in the fitted grid
  EXPECT_EQ(inside, [&] {
    size_t count = 0;
    for (size_t v = 0; v < posed.volume.values.size(); ++v) {
      count += world.DeepInside(
          motion.Inverse() * posed.volume.grid.ToMm(PointVox{posed.volume.grid.Ijk(v).cast<double>()}), 2);
    }
    return count;
  }());
}

TEST(PosingEngine, ABentHingeAgreesWithMappedPointsAndHasNoHoles) {
  const HingeWorld world;
  const DisplacementField bulge = world.Bulge(1.5);
  const PosingEngine engine(SharedBackend(), world.Inputs({&bulge}));
  for (const double angle : {0.35, 0.8}) {
    ResolvedPose pose = world.Posed(world.Bent(angle));
    pose.coefficients = Eigen::MatrixXf::Constant(2, 1, 0.8f);
    const PosedVolume posed = engine.Pose(pose);
    const auto [mean, most] = Disagreement(world, engine, pose, posed.volume);
    EXPECT_LT(mean, 0.6)
        << angle;  // sampling the posed grid trilinearly costs about this much (texture amplitude 45)
    EXPECT_LT(most, 8) << angle;  // a hole would be 100 or more
  }
}

TEST(PosingEngine, UnitCoefficientsReproduceTheExample) {
  const HingeWorld world;
  const DisplacementField bulge = world.Bulge(2), none = world.Bulge(0);
  const PosingEngine engine(SharedBackend(), world.Inputs({&none, &bulge}));
  ResolvedPose pose = world.Posed(world.Bent(0.6));
  pose.coefficients = Eigen::MatrixXf::Zero(2, 2);
  pose.coefficients.col(1).setOnes();
  std::vector<PointMm> nodes = BodyPoints(world, 0.0);
  const std::vector<PointMm> mapped = engine.MapPoints(pose, nodes);
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Eigen::Vector3i n = world.body.grid.ToVox(nodes[i]).ijk.array().round().cast<int>();
    const AffineMap blend = Blend(world.weights(n.x(), n.y(), n.z()), pose.scan_from_template);
    const Eigen::Vector3d oracle = Apply(blend, nodes[i].lps + bulge(n.x(), n.y(), n.z()).cast<double>());
    ASSERT_LT((mapped[i].lps - oracle).norm(), 1e-3);
  }
}

// Along a row of voxels out of a bone: its last voxel's outer half moves as the bone, and from there to the
// next voxel's centre nothing jumps.
TEST(PosingEngine, PointsUpToABonesBorderMoveAsTheBoneDoes) {
  HingeWorld world;
  const Grid& grid = world.body.grid;
  Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);  // of the outer bone, before tissue along i
  for (size_t v = 0; v < world.bones.labels.values.size(); ++v) {
    const Eigen::Vector3i n = grid.Ijk(v);
    if (world.bones.labels.values[v] != 2) continue;
    world.weights.values[v] = {{1, 0, 0, 0}, {1, 0, 0, 0}};
    if (!world.bones.labels(n.x() + 1, n.y(), n.z())) last = n;
  }
  ASSERT_GE(last.x(), 0);
  for (int i = last.x() + 1; i < grid.size.x(); ++i)  // tissue of the other bone: the motions differ
    for (int j = last.y() - 1; j <= last.y() + 1; ++j)
      for (int k = last.z() - 1; k <= last.z() + 1; ++k)
        world.weights.values[grid.Index(i, j, k)] = {{0, 1, 0, 0}, {1, 0, 0, 0}};
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const ResolvedPose pose = world.Posed(world.Bent(0.8));
  const auto at = [&](double beyond) {
    return grid.ToMm(PointVox{last.cast<double>() + Eigen::Vector3d(beyond, 0, 0)});
  };
  const auto posed = [&](double beyond) { return engine.MapPoints(pose, {at(beyond)})[0].lps; };
  for (const double beyond : {0.0, 0.2, 0.4, 0.499})
    EXPECT_LT((posed(beyond) - (pose.scan_from_template[1] * at(beyond)).lps).norm(), 1e-9) << beyond;
  EXPECT_LT((posed(1) - at(1).lps).norm(), 1e-9);
  const double apart = ((pose.scan_from_template[1] * at(0.75)).lps - at(0.75).lps).norm();
  EXPECT_GT(apart, 3);
  for (double beyond = 0.0; beyond < 1.2; beyond += 0.01)  // four times the step at most
    ASSERT_LT((posed(beyond + 0.01) - posed(beyond)).norm(), 0.05 * apart + 0.1) << beyond;
}

TEST(PosingEngine, LabelsMoveWithTheirBones) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const ResolvedPose pose = world.Posed(world.Bent(0.7));
  const LabelMap posed = engine.PoseLabels(pose);
  size_t outer = 0, wrong = 0, at_template = 0;
  for (size_t v = 0; v < posed.values.size(); ++v) {
    const PointMm x =
        pose.scan_from_template[1].Inverse() * posed.grid.ToMm(PointVox{posed.grid.Ijk(v).cast<double>()});
    const Eigen::Vector3i n = world.body.grid.ToVox(x).ijk.array().round().cast<int>();
    const bool here = world.body.grid.Contains(n) && world.bones.labels(n.x(), n.y(), n.z()) == 2;
    outer += here, wrong += here != (posed.values[v] == 2);
  }
  for (const uint16_t label : world.bones.labels.values) at_template += label == 2;
  EXPECT_NEAR(double(outer), double(at_template), 0.02 * double(at_template));
  EXPECT_LE(wrong, outer / 100);
}

TEST(PosingEngine, TheFittedGridHoldsTheBodyOnTheTemplatesLattice) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const ResolvedPose pose = world.Posed(world.Bent(1.2));
  const Grid fitted = engine.FittedGrid(pose);
  const Eigen::Vector3d origin = world.body.grid.ToVox(fitted.origin).ijk;
  EXPECT_LT((origin - origin.array().round().matrix()).cwiseAbs().maxCoeff(), 1e-6);
  for (const PointMm& x : engine.MapPoints(pose, BodyPoints(world, 0)))
    ASSERT_TRUE(fitted.Contains(fitted.ToVox(x)));
  EXPECT_EQ(engine.FittedGrid(pose, 1).size, ((fitted.size.array() + 1) / 2).matrix());
}

// Asked for alone it is found from the few bricks that end the body, and it is the grid of the volume.
TEST(PosingEngine, TheFittedGridIsTheVolumesHoweverTheBodyIsPosed) {
  const HingeWorld world;
  const DisplacementField bulge = world.Bulge(2.5);
  const PosingEngine engine(SharedBackend(), world.Inputs({&bulge}));
  for (const double angle : {-0.7, 0.0, 0.4, 1.3, 2.6}) {
    ResolvedPose pose = world.Posed(world.Bent(angle));
    pose.coefficients = Eigen::MatrixXf::Constant(2, 1, float(1 + angle));
    ASSERT_TRUE(engine.FittedGrid(pose) == engine.Pose(pose).volume.grid) << angle;
  }
}

TEST(PosingEngine, AGridAskedForIsUsedAndLevelsHalveIt) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  Grid grid = world.body.grid;
  grid.direction.col(0) *= -1;  // left-handed: orientation must not turn cells inside out
  grid.origin = world.body.grid.ToMm(PointVox{Eigen::Vector3d(grid.size.x() - 1, 0, 0)});
  const PosedVolume posed = engine.Pose(world.Posed(world.Bent(0)), grid);
  ASSERT_TRUE(posed.volume.grid == grid);
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int i = 0; i < grid.size.x(); ++i) {
      ASSERT_NEAR(posed.volume(i, 15, k), world.scan.volume(grid.size.x() - 1 - i, 15, k), 2e-3);
    }
  }
  EXPECT_TRUE(engine.Pose(world.Posed(world.Bent(0)), grid, 1).volume.grid == Coarsened(grid, 2));
}

TEST(PosingEngine, TwiceTheSamePoseIsTwiceTheSameVolume) {
  const HingeWorld world;
  const DisplacementField bulge = world.Bulge(1);
  ResolvedPose pose = world.Posed(world.Bent(2.2));  // folds at the hinge
  pose.coefficients = Eigen::MatrixXf::Ones(2, 1);
  const PosingEngine engine(SharedBackend(), world.Inputs({&bulge})),
      other(SharedBackend(), world.Inputs({&bulge}));
  const PosedVolume first = engine.Pose(pose);
  engine.Pose(world.Posed(world.Bent(0.2)));
  EXPECT_GT(first.folded_fraction, 0);
  EXPECT_EQ(first.volume.values, engine.Pose(pose).volume.values);
  EXPECT_EQ(first.volume.values, other.Pose(pose).volume.values);
}

TEST(PosingEngine, APoseThatFlingsBonesApartIsRefused) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  PoseVector pose = world.Bent(0);
  pose[1].translation_mm = {1e6, 1e6, 1e6};
  EXPECT_THROW(engine.Pose(world.Posed(pose)), InputError);
}

TEST(PosingEngine, AGridOfMoreVoxelsThanAreGrantedIsRefused) {
  const HingeWorld world;
  const double granted = 2 * double(world.body.grid.VoxelCount());
  const PosingEngine engine(SharedBackend(), world.Inputs()),
      narrow(SharedBackend(), world.Inputs(), granted);
  PoseVector apart = world.Bent(0);
  apart[1].translation_mm =
      3 * world.body.grid.size.x() * world.body.grid.spacing_mm.x() * world.body.grid.direction.col(0);
  const ResolvedPose pose = world.Posed(apart);
  EXPECT_GT(double(engine.FittedGrid(pose).VoxelCount()), granted);
  EXPECT_GT(double(engine.Pose(pose).volume.values.size()), granted);
  EXPECT_THROW(narrow.FittedGrid(pose), InputError);
  EXPECT_THROW(narrow.Pose(pose), InputError);
  EXPECT_THROW(narrow.PoseLabels(pose, {}, 2), InputError) << "the level comes afterwards";
  EXPECT_THROW(narrow.Pose(world.Posed(world.Bent(0)), engine.FittedGrid(pose)), InputError);
  EXPECT_NO_THROW(narrow.Pose(world.Posed(world.Bent(0))));
}

// A pose that spreads over much leaves no more behind than the next one needs.
TEST(PosingEngine, WhatOneLargeGridNeededIsGivenBack) {
  const HingeWorld world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const ResolvedPose pose = world.Posed(world.Bent(0.2));
  Grid wide = world.body.grid;
  wide.size *= 2;
  const auto taken_by = [&](const Grid& grid) {
    const int64_t before = engine.allocations();
    engine.Pose(pose, grid, 1);
    return engine.allocations() - before;
  };
  taken_by(wide), taken_by(world.body.grid);
  EXPECT_EQ(taken_by(world.body.grid), 0) << "a steady stream of poses allocates nothing";
  EXPECT_GT(taken_by(wide), 0);
}

}  // namespace
}  // namespace kvx
