// Bones that look nearly the same when turned by half: right, or flagged.
#include "pipeline/bones/search/twin_poses.h"

#include <gtest/gtest.h>

#include "pipeline/bones/search/hypothesis_tree.h"
#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

const Grid kView = Box({60, 60, 60}, {1.2, 1.2, 1.2}, kOblique.transpose());

RigidTransform TurnedBy(double deg, const Eigen::Vector3d& axis) {
  return Exp((Twist() << RadFromDeg(deg) * axis.normalized(), 2, -1, 1.5).finished());
}

// A texture that differs from its half turns is enough to decide, or else the bone is named.
TEST(TwinPoses, ATexturedEllipsoidTurnedFarIsRightOrFlagged) {
  const EllipsoidWorld world(kOneBone, Box({56, 44, 34}, {1.0, 1.2, 1.5}, kOblique));
  size_t right = 0, turns = 0;
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), {0, 1, 0}, {1, 2, -1}}) {
    for (const double deg : {140.0, 175.0}) {
      const RigidTransform truth = TurnedBy(deg, axis);
      const BoneFit fit = world.Register(Painted(kView, kOneBone, {truth})).at(0);
      const double off_deg = AngleDeg(fit.scan_from_template, truth);
      EXPECT_TRUE(off_deg < 1.5 || fit.Doubtful()) << deg << " about " << axis.transpose() << ": " << off_deg;
      right += off_deg < 1.5, ++turns;
    }
  }
  EXPECT_GE(right, turns / 2);
}

// A bone of even grey in even tissue equals its half turns: nothing can decide.
TEST(TwinPoses, ABoneThatEqualsItsHalfTurnsIsFlagged) {
  EllipsoidWorld world(kOneBone, Box({56, 44, 34}, {1.0, 1.2, 1.5}, Eigen::Matrix3d::Identity()));
  const auto even = [&](const Grid& grid, const RigidTransform& pose) {
    Volume out(grid);
    for (size_t v = 0; v < out.values.size(); ++v) {
      const PointMm x = pose.Inverse() * grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
      const double shell = Beyond(kOneBone[0], x.lps, 0.8), outside = Beyond(kOneBone[0], x.lps, 1.0);
      out.values[v] = float(90 * outside + (20 * shell + 150 * (1 - shell)) * (1 - outside));
    }
    return out;
  };
  auto scan = std::make_shared<Scan>();
  scan->volume = even(world.template_scan->volume.grid, {});
  world.template_scan.value = scan;
  const BoneFit fit = world.Register(even(kView, TurnedBy(40, {1, 2, -1}))).at(0);
  EXPECT_TRUE(fit.Doubtful());
  EXPECT_NE(fit.note.find("nearly as well"), std::string::npos) << fit.note;
}

// A hinge bent by 40 degrees, its tip as a search leaves it that could hardly tell it from `rivals`.
class RivalledTip : public testing::Test {
 protected:
  Candidate Compared(const RigidTransform& tip, const std::vector<RigidTransform>& rivals,
                     bool base_has_rival = false) const {
    const Volume scan = Painted(Box({96, 72, 44}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity()), kHinge,
                                {RigidTransform{}, truth_});
    const SoughtBones sought = world_.SoughtIn(scan);
    const BoneSearch search(sought, scan, SharedBackend(), {});
    std::vector<Candidate> found{search.At(0, PartialPose(2), {}),
                                 search.At(1, {RigidTransform{}, std::nullopt}, tip)};
    found[1] = search.Finest(1, found[1]);
    found[1].runner_up_nats = found[1].nats - 1;
    found[1].rivals = rivals;
    if (base_has_rival) found[0].runner_up_nats = found[0].nats - 1;
    CompareTwins(search, found);
    return found[1];
  }
  static RigidTransform BentBy(double deg) {
    return RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(deg));
  }

  const RigidTransform truth_ = BentBy(40);
  EllipsoidWorld world_{kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity())};
};

TEST_F(RivalledTip, IsSureWhereNoRivalStandsACloserLook) {
  const Candidate tip = Compared(truth_, {BentBy(-50), BentBy(41)});
  EXPECT_FALSE(HasRival(tip)) << tip.nats << " and " << tip.runner_up_nats;
  EXPECT_LT(AngleDeg(tip.pose, truth_), 0.5);
}

TEST_F(RivalledTip, GoesWhereARivalProvesBetter) {
  const Candidate tip = Compared(BentBy(-50), {BentBy(38)});
  EXPECT_FALSE(HasRival(tip)) << tip.nats << " and " << tip.runner_up_nats;
  EXPECT_LT(AngleDeg(tip.pose, truth_), 0.5);
}

TEST_F(RivalledTip, StaysRivalledBesideABaseThatIs) {
  EXPECT_TRUE(HasRival(Compared(truth_, {BentBy(-50)}, true)));
}

TEST_F(RivalledTip, StaysRivalledWhereNobodyKnowsByWhat) { EXPECT_TRUE(HasRival(Compared(truth_, {}))); }

}  // namespace
}  // namespace kvx
