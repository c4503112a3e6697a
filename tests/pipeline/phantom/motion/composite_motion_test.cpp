// The true map of a bent knee: its inverse inverts it, bones move rigidly, the template stays where it is.
#include "pipeline/phantom/motion/composite_motion.h"

#include <gtest/gtest.h>

namespace kvx::phantom {
namespace {

using V = Eigen::Vector3d;

// A coarse knee bent by about 25 and 50 degrees, solved once.
struct BentKnee {
  Anatomy anatomy = Coarse();
  BoneFields fields{anatomy};
  BodyModel body{anatomy, fields, SolidOptions{}};
  DistanceGrid skin = SampleDistance(anatomy.body.Bounds().Grown(20), 3,
                                     [this](const V& x) { return anatomy.body.Distance(x); });
  std::vector<PhantomPose> poses = MakePoses(anatomy, 3);
  BodyModel::Posed rest = body.Pose(poses[0], {}), bent = body.Pose(poses[1], {}),
                   far_bent = body.Pose(poses[2], {});

  static Anatomy Coarse() {
    Anatomy knee = MakeKnee(3);
    knee.cell_mm = 11;
    knee.distance_step_mm = 2;
    return knee;
  }
  CompositeMotion Motion(const BodyModel::Posed& posed) const {
    return {anatomy, fields, skin, body.mesh(), posed};
  }
  std::vector<V> PointsInBody(int count) const {
    Random random(5, "points");
    std::vector<V> points;
    while (points.size() < size_t(count)) {
      const double x = random.Uniform(-70, 70), y = random.Uniform(-150, 150);
      const V p(x, y, random.Uniform(-60, 60));
      if (anatomy.body.Distance(p) < 0) points.push_back(p);
    }
    return points;
  }
};

const BentKnee& Knee() {
  static const BentKnee knee;
  return knee;
}

TEST(CompositeMotion, LeavesTheTemplateWhereItIs) {
  const CompositeMotion motion = Knee().Motion(Knee().rest);
  for (const V& p : Knee().PointsInBody(300)) {
    const auto posed = motion.Forward(p);
    ASSERT_TRUE(posed);
    EXPECT_LT((*posed - p).norm(), 1e-9);
  }
}

TEST(CompositeMotion, InverseUndoesForward) {
  const CompositeMotion motion = Knee().Motion(Knee().bent);
  int found = 0, total = 0;
  for (const V& p : Knee().PointsInBody(1000)) {
    const auto posed = motion.Forward(p);
    ASSERT_TRUE(posed);
    const auto back = motion.Inverse(*posed);
    ++total;
    if (back && (back->rest - p).norm() < 1e-3)
      ++found;  // the rest is hidden under a bone or behind other tissue
    if (back) {
      const auto again = motion.Forward(back->rest);  // whatever is seen there does lie there
      ASSERT_TRUE(again);
      EXPECT_LT((*again - *posed).norm(), 1e-3);
    }
  }
  EXPECT_GT(found, 0.97 * total);
}

// Of the map, by its differences; turned inside out or nearly so where this is not above 0.
double VolumeRatio(const CompositeMotion& motion, const V& rest) {
  constexpr double kStep = 0.01;
  Eigen::Matrix3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    const V along = kStep * V::Unit(axis);
    slope.col(axis) = (*motion.Forward(rest + along) - *motion.Forward(rest - along)) / (2 * kStep);
  }
  return slope.determinant();
}

// Where tissue grows on bone its map is steep and bent.
TEST(CompositeMotion, InverseFindsTissueWhereverItGrowsOnBone) {
  for (const BodyModel::Posed& posed : {Knee().bent, Knee().far_bent}) {
    const CompositeMotion motion = Knee().Motion(posed);
    int found = 0, total = 0;
    for (const V& p : Knee().PointsInBody(20000)) {
      const double bone_mm = Knee().fields.Nearest(p).distance_mm;
      if (bone_mm <= 0 || bone_mm > 0.6 * Knee().anatomy.cell_mm) continue;
      if (Knee().anatomy.body.Distance(p) > -1 || VolumeRatio(motion, p) < 0.3) continue;
      found += motion.Inverse(*motion.Forward(p)).has_value();
      ++total;
    }
    EXPECT_GT(total, 1000);
    EXPECT_EQ(found, total);
  }
}

TEST(CompositeMotion, MovesBonesExactlyRigidly) {
  const CompositeMotion motion = Knee().Motion(Knee().bent);
  int in_bone = 0;
  for (const V& p : Knee().PointsInBody(2000)) {
    const int bone = motion.Carrier(p);
    if (bone < 0) continue;
    ++in_bone;
    EXPECT_LT((*motion.Forward(p) - Move(Knee().bent.posed_from_template[size_t(bone)], p)).norm(), 1e-9);
  }
  EXPECT_GT(in_bone, 100);
  EXPECT_GT(Knee().bent.posed_from_template[1].AngleRad(), RadFromDeg(20));
}

TEST(BodyModel, FollowsBonesThatAllMoveAlike) {
  PhantomPose pose;
  pose.index = 1;
  Anatomy anatomy = BentKnee::Coarse();
  anatomy.joints.clear();
  const BoneFields fields(anatomy);
  const BodyModel body(anatomy, fields, SolidOptions{});
  const BodyModel::Posed posed = body.Pose(pose, {});
  for (size_t n = 0; n < posed.nodes.size(); ++n)
    EXPECT_LT((posed.nodes[n] - body.mesh().nodes[n]).norm(), 1e-9);
  std::vector<RigidTransform> motions(anatomy.bones.size(), RotationAbout({V(5, 2, 1)}, V(1, -1, 2), 0.7));
  for (const V& p : Knee().PointsInBody(50))
    EXPECT_LT((body.Guess(p, motions) - Move(motions[0], p)).norm(), 1e-9);
}

// A knee that bends until calf and thigh meet.
TEST(BodyModel, TissueThatHasMetStaysApart) {
  Anatomy anatomy = MakeKnee(501);
  anatomy.cell_mm = 11;
  anatomy.distance_step_mm = 2;
  const BoneFields fields(anatomy);
  const BodyModel body(anatomy, fields, SolidOptions{});
  const BodyModel::Posed posed = body.Pose(MakePoses(anatomy, 501)[3], {});
  const SelfContact contact(body.mesh(), [&](const V& x) { return anatomy.body.Distance(x); });
  const std::vector<SolidContact> found = contact.Find(posed.nodes);
  EXPECT_GT(found.size(), 20u);
  EXPECT_LT(OverlapMm(found), 0.2 * anatomy.cell_mm);
}

TEST(BodyModel, BendsWithoutTurningTissueInsideOut) {
  EXPECT_LE(Knee().bent.inverted_share, 0.001);
  EXPECT_LE(Knee().bent.residual, SolidOptions{}.tolerance);
}

}  // namespace
}  // namespace kvx::phantom
