// A bone put where it is not is found again; one that is right stays.
#include "pipeline/bones/lost_bones.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

class LostBones : public testing::Test {
 protected:
  LostBones()
      : world_(kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity())),
        truth_{RigidTransform{}, RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(40))} {
    scan_ = Painted(Box({96, 72, 44}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity()), kHinge, truth_);
  }
  // The tip as the search would see it there.
  std::vector<Candidate> With(const BoneSearch& search, const RigidTransform& tip) const {
    Candidate base = search.At(0, PartialPose(2), truth_[0]);
    return {base, search.At(1, {truth_[0], std::nullopt}, tip)};
  }
  double TipOffDeg(const std::vector<Candidate>& found) const { return AngleDeg(found[1].pose, truth_[1]); }

  EllipsoidWorld world_;
  PoseVector truth_;
  Volume scan_;
  std::map<std::string, RigidTransform> hints_;
};

TEST_F(LostBones, WhatLeftTheViewIsFoundAgain) {
  const BoneSearch search(*world_.bones, world_.template_scan->volume, scan_, SharedBackend(), hints_);
  RigidTransform away;
  away.translation_mm = {300, 0, 0};
  std::vector<Candidate> found = With(search, away);
  ASSERT_LT(found[1].inside, kSeenPart);
  found[1].correlation = 1;  // of the few samples that a view's corner may show
  FindTheLost(search, found);
  EXPECT_LT(TipOffDeg(found), 3);
}

TEST_F(LostBones, WhatHardlyMatchesIsFoundAgain) {
  const BoneSearch search(*world_.bones, world_.template_scan->volume, scan_, SharedBackend(), hints_);
  std::vector<Candidate> found = With(search, RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(-60)));
  ASSERT_LT(found[1].correlation, kWeakCorrelation);
  FindTheLost(search, found);
  EXPECT_LT(TipOffDeg(found), 3);
}

TEST_F(LostBones, WhatIsRightStays) {
  const BoneSearch search(*world_.bones, world_.template_scan->volume, scan_, SharedBackend(), hints_);
  std::vector<Candidate> found = With(search, truth_[1]);
  FindTheLost(search, found);
  EXPECT_EQ(RowMajor(found[1].pose), RowMajor(truth_[1]));
}

}  // namespace
}  // namespace kvx
