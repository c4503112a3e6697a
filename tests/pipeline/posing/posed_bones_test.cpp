// Posed volumes and label maps show bones as their rigid motions give them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;

// What is a bone's by its own motion, beyond half of the trilinear share of its voxels.
struct RigidBone {
  Volume share;  // on the template's grid
  uint16_t label = 0;
  RigidTransform back;
  double ShareAt(const PointVox& own) const { return SampleTrilinear(share, own, 0); }
};

RigidBone RigidBoneOf(const BoneSet& bones, int bone, const ResolvedPose& pose) {
  RigidBone out{Volume(bones.labels.grid, 0), uint16_t(bones.bones[size_t(bone)].label),
                pose.scan_from_template[size_t(bone)].Inverse()};
  for (size_t v = 0; v < out.share.values.size(); ++v)
    out.share.values[v] = bones.labels.values[v] == out.label;
  return out;
}

size_t VoxelsOf(const LabelMap& labels, uint16_t label) {
  return size_t(std::ranges::count(labels.values, label));
}

TEST(PosedBones, KeepTheVolumeOfTheirVoxelsWhenTheyAreSmall) {
  HingeWorld world;
  const Grid& grid = world.body.grid;
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {  // a ball in the outer bone; all moves as one
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    world.bones.labels.values[v] = (x.lps - (world.hinge.lps + 10 * world.along)).norm() < 2.5 ? 2 : 0;
    world.weights.values[v] = {{1, 0, 0, 0}, {1, 0, 0, 0}};
  }
  const size_t voxels = VoxelsOf(world.bones.labels, 2);
  ASSERT_NEAR(double(voxels), 60, 25);
  const PosingEngine engine(SharedBackend(), world.Inputs());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(-1, 1);
  const auto direction = [&] { return Eigen::Vector3d(part(random), part(random), part(random)); };
  constexpr int kPoses = 30;
  double sum = 0;
  for (int n = 0; n < kPoses; ++n) {
    const Eigen::Vector3d axis = direction().normalized();
    const RigidTransform posed{Eigen::Quaterniond(Eigen::AngleAxisd(3 * part(random), axis)), direction()};
    sum += double(VoxelsOf(engine.PoseLabels(world.Posed({posed, posed})), 2));
  }
  EXPECT_NEAR(sum / kPoses / double(voxels), 1, 0.02);
}

// No gap opens at a joint where bones touch, though each has places with less than half of the share.
TEST(PosedBones, TouchWhereTheirVoxelsTouch) {
  HingeWorld world;
  const Grid& grid = world.body.grid;
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    const bool outer = world.along.dot(x.lps - world.hinge.lps) > 0;
    world.bones.labels.values[v] = !world.DeepInside(x, 4) ? 0 : outer ? 2 : 1;
    world.weights.values[v] = {{1, 0, 0, 0}, {1, 0, 0, 0}};
  }
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const RigidTransform posed{Eigen::Quaterniond(Eigen::AngleAxisd(0.4, world.across)), {0.3, 0.2, -0.4}};
  const LabelMap labels = engine.PoseLabels(world.Posed({posed, posed}));
  int beside_hinge = 0;
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const PointMm x = posed.Inverse() * labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()});
    if (std::abs(world.along.dot(x.lps - world.hinge.lps)) > 2 || !world.DeepInside(x, 6)) continue;
    ++beside_hinge;
    ASSERT_NE(labels.values[v], 0);
  }
  EXPECT_GT(beside_hinge, 20);
}

// Bones whose tissue follows them by half: the voxels between are stretched, squeezed and sheared. Labels go
// on below half, down to the bone's level, where the tissue beside has a say.
TEST(PosedBones, AreRigidOutToTheirBordersHoweverTheTissueBesideThemMoves) {
  HingeWorld world;
  for (size_t v = 0; v < world.weights.values.size(); ++v)
    if (world.bones.labels.values[v] == 0) world.weights.values[v] = {{0, 1, 0, 0}, {0.5f, 0.5f, 0, 0}};
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const Grid& grid = world.body.grid;
  for (const double angle_rad : {0.0, 0.05, 0.1}) {
    const ResolvedPose pose = world.Posed(world.Bent(angle_rad));
    const LabelMap labels = engine.PoseLabels(pose, grid);
    const Volume posed = engine.Pose(pose, grid).volume;
    for (int bone = 0; bone < 2; ++bone) {
      const RigidBone rigid = RigidBoneOf(world.bones, bone, pose);
      double off = 0;
      size_t wrong = 0;
      for (size_t v = 0; v < grid.VoxelCount(); ++v) {
        const PointVox own = grid.ToVox(rigid.back * grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}));
        const double share = rigid.ShareAt(own);
        const bool labelled = labels.values[v] == rigid.label;
        wrong += share >= 0.5 ? !labelled : share < 0.4 && labelled;
        if (share >= 0.5 && share < 0.99 && labelled)
          off = std::max(off, std::abs(posed.values[v] - double(SampleTrilinear(world.scan.volume, own, 0))));
      }
      EXPECT_LE(wrong, VoxelsOf(world.bones.labels, rigid.label) / 100) << angle_rad << " rad, bone " << bone;
      EXPECT_LT(off, 0.1) << angle_rad << " rad, bone " << bone;
    }
  }
}

}  // namespace
}  // namespace kvx
