// Material points around a bone that moves: which a scan sees, which it shows, counted by hand.
#include "pipeline/phantom/truth_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/bone_in_a_ball.h"

namespace kvx::phantom {
namespace {

using ::testing::ElementsAre;
using testing_support::BoneInABall;
using V = Eigen::Vector3d;

const ScanGrid kScanGrid{{20, 20, 20}, V(4, 4, 4)};  // sees 38 mm around 0

RigidTransform Aside(double x_mm) {
  RigidTransform aside;
  aside.translation_mm.x() = x_mm;
  return aside;
}

TEST(MoveTruthPoints, SaysWhatTheScanSeesAndShows) {
  const BoneInABall body(Aside(10));
  const std::vector<TruthPoint> points = {{V(14, 0, 0), Tissue::kMuscle, 0, 0},   // where the rod goes
                                          {V(-14, 0, 0), Tissue::kMuscle, 0, 0},  // behind it
                                          {V(0, 14, 0), Tissue::kMuscle, 0, 0},   // beside it
                                          {V(3, 2, 1), Tissue::kMarrow, 1, 0}};   // in it
  const TruthPositions moved = MoveTruthPoints(points, body.Motion(), Aside(27), kScanGrid);
  EXPECT_THAT(moved.hidden, ElementsAre(1, 0, 0, 0));
  EXPECT_THAT(moved.in_fov, ElementsAre(0, 1, 1, 0));  // at x = 41, 13, 27 and 40
  EXPECT_DOUBLE_EQ(moved.hidden_share, 0.25);
  EXPECT_DOUBLE_EQ(moved.in_fov_share, 0.5);
  EXPECT_LT((moved.in_scan[0] - V(41, 0, 0)).norm(), 1e-9);
  EXPECT_LT((moved.in_scan[3] - V(40, 2, 1)).norm(), 1e-9);
}

TEST(DrawTruthPoints, FarFromAJointIsWhoIsFarFromOneOfItsBones) {
  const BoneInABall body{RigidTransform{}};
  const TissueModel tissues(body.anatomy(), 7);
  const auto points = DrawTruthPoints(body.anatomy(), tissues, kScanGrid, body.Motion(), 100, 7);
  for (const TruthPoint& point : points) {
    const V beside_rod(point.rest.x(), point.rest.y(), std::max(0.0, std::abs(point.rest.z()) - 12));
    const double rod = beside_rod.norm() - BoneInABall::kRodMm;
    const double pellet = (point.rest - V(0, BoneInABall::kPelletAtMm, 0)).norm() - BoneInABall::kPelletMm;
    EXPECT_NEAR(point.joint_mm, std::max(rod, pellet), 1e-9);
    EXPECT_EQ(point.bone, rod <= 0 ? 1 : pellet <= 0 ? 2 : 0);
  }
}

// Two rods of tissue along z, 6 mm in radius, 24 mm apart at rest.
struct TwoRods {
  Anatomy anatomy;
  BoneFields fields{anatomy};
  TetMesh mesh;
  DistanceGrid skin;
  BodyModel::Posed posed;

  explicit TwoRods(const std::function<V(const V&)>& moved) {
    for (const double x : {-12.0, 12.0}) anatomy.body.cones.push_back({V(x, 0, -20), V(x, 0, 20), 6, 6});
    const auto distance = [this](const V& x) { return anatomy.body.Distance(x); };
    mesh = MakeTetMesh({anatomy.body.Bounds(), distance, {}}, 3);
    skin = SampleDistance(anatomy.body.Bounds().Grown(6), 0.5, distance);
    for (const V& node : mesh.nodes) posed.nodes.push_back(moved(node));
  }
  CompositeMotion Motion() const { return {anatomy, fields, skin, mesh, posed}; }
};

const std::vector<TruthPoint> kInARod = {{V(-10, 0, 0), Tissue::kMuscle, 0, 0},
                                         {V(-12, 0, 0), Tissue::kMuscle, 0, 0},
                                         {V(-17, 0, 0), Tissue::kMuscle, 0, 0}};

TEST(FaultsOf, TissueInOtherTissueIsFoundHoweverDeep) {
  const TwoRods rods([](const V& x) { return V(x.x() - std::copysign(10, x.x()), x.y(), x.z()); });
  const CompositeMotion motion = rods.Motion();
  EXPECT_NEAR(motion.SharedDepthMm(kInARod[0].rest), 4, 0.1);  // half way between axes that are 4 mm apart
  EXPECT_NEAR(motion.SharedDepthMm(kInARod[1].rest), 2, 0.1);  // on its own axis
  EXPECT_EQ(motion.SharedDepthMm(kInARod[2].rest), 0);
  const MapFaults faults = FaultsOf(kInARod, motion);
  EXPECT_DOUBLE_EQ(faults.overlapping_share, 2 / 3.0);
  EXPECT_NEAR(faults.overlap_mm, 4, 0.1);
  EXPECT_EQ(faults.folded_share, 0);
}

TEST(FaultsOf, MirroredTissueIsInsideOut) {
  const TwoRods rods([](const V& x) { return V(x.x() < 0 ? 2 * x.x() : x.x(), x.y(), -x.z()); });
  EXPECT_NEAR(*rods.Motion().VolumeRatio(V(-12, 1, 3)), -2, 1e-9);
  EXPECT_NEAR(*rods.Motion().VolumeRatio(V(12, 1, 3)), -1, 1e-9);
  EXPECT_EQ(FaultsOf(kInARod, rods.Motion()).folded_share, 1);
}

}  // namespace
}  // namespace kvx::phantom
