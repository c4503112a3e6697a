// Posed volumes and label maps show bones as their rigid motions give them.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/dice.h"
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

// Bones whose tissue follows them by half: the voxels between are stretched, squeezed and sheared.
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
      LabelMap expected(grid);
      double off = 0;
      for (size_t v = 0; v < grid.VoxelCount(); ++v) {
        const PointVox own = grid.ToVox(rigid.back * grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}));
        const double share = rigid.ShareAt(own);
        if (share < 0.5) continue;
        expected.values[v] = rigid.label;
        if (share < 0.99 && labels.values[v] == rigid.label)
          off = std::max(off, std::abs(posed.values[v] - double(SampleTrilinear(world.scan.volume, own, 0))));
      }
      EXPECT_GT(Dice(labels, expected, rigid.label), 0.99) << angle_rad << " rad, bone " << bone;
      EXPECT_LT(off, 0.1) << angle_rad << " rad, bone " << bone;
    }
  }
}

}  // namespace
}  // namespace kvx
