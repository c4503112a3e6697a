// A bone put where it is not is found again; one that is right stays.
#include "pipeline/bones/search/lost_bones.h"

#include <gtest/gtest.h>

#include <random>

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
  const SoughtBones sought = world_.SoughtIn(scan_);
  const BoneSearch search(sought, scan_, SharedBackend(), hints_);
  RigidTransform away;
  away.translation_mm = {300, 0, 0};
  std::vector<Candidate> found = With(search, away);
  ASSERT_LT(found[1].inside, kSeenPart);
  found[1].correlation = 1;  // of the few samples that a view's corner may show
  FindTheLost(search, found);
  EXPECT_LT(TipOffDeg(found), 3);
}

TEST_F(LostBones, WhatHardlyMatchesIsFoundAgain) {
  const SoughtBones sought = world_.SoughtIn(scan_);
  const BoneSearch search(sought, scan_, SharedBackend(), hints_);
  std::vector<Candidate> found = With(search, RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(-60)));
  ASSERT_LT(found[1].correlation, kWeakCorrelation);
  FindTheLost(search, found);
  EXPECT_LT(TipOffDeg(found), 3);
}

TEST_F(LostBones, WhatIsRightStays) {
  const SoughtBones sought = world_.SoughtIn(scan_);
  const BoneSearch search(sought, scan_, SharedBackend(), hints_);
  std::vector<Candidate> found = With(search, truth_[1]);
  FindTheLost(search, found);
  EXPECT_EQ(RowMajor(found[1].pose), RowMajor(truth_[1]));
}

// A small tip, bent far, in a noisy scan: what it matches there hardly makes up for the bend. Stretched into
// even tissue it costs no bend and matches nothing, which is no place for a bone that is in view.
class SmallTip : public testing::Test {
 protected:
  SmallTip()
      : world_({{"base", "", {-19, 0, 0}, {18, 8, 7}}, {"tip", "base", {7, 0, 0}, {7, 3.5, 3}}},
               Box({84, 60, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity())),
        truth_{RigidTransform{}, RotationAbout(PointMm{{-0.5, 0, 0}}, {0, 0, 1}, RadFromDeg(70))} {}

  Volume NoisyScan(const Grid& grid) const {
    Volume scan = Painted(grid, world_.ellipsoids, truth_);
    std::mt19937 random(3);
    for (float& value : scan.values) value += 90 * (float(random()) / float(random.max()) - 0.5f);
    return scan;
  }
  std::vector<Candidate> Stretched(const BoneSearch& search) const {
    return {search.At(0, PartialPose(2), truth_[0]), search.At(1, {truth_[0], std::nullopt}, truth_[0])};
  }

  EllipsoidWorld world_;
  PoseVector truth_;
  std::map<std::string, RigidTransform> hints_;
};

TEST_F(SmallTip, IsNotLeftWhereItMatchesNothing) {
  const Volume scan = NoisyScan(Box({84, 60, 40}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity()));
  const SoughtBones sought = world_.SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), hints_);
  std::vector<Candidate> found = Stretched(search);
  ASSERT_LT(found[1].correlation, kWeakCorrelation);
  FindTheLost(search, found);
  EXPECT_LT(AngleDeg(found[1].pose, truth_[1]), 20);
}

// Of a view that ends in the tip, as its parent would carry it, nothing is learnt from how little matches.
TEST_F(SmallTip, StaysWhereTheViewEnds) {
  truth_[1] = RotationAbout(PointMm{{-0.5, 0, 0}}, {0, 0, 1}, RadFromDeg(50));
  Grid grid = Box({48, 60, 40}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity());
  grid.origin.lps.x() = 3.0 - 44.0;
  const Volume scan = NoisyScan(grid);
  const SoughtBones sought = world_.SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), hints_);
  std::vector<Candidate> found = Stretched(search);
  ASSERT_LT(found[1].inside, 0.5);
  FindTheLost(search, found);
  EXPECT_LT(AngleDeg(found[1].pose, truth_[0]), 15);
}

}  // namespace
}  // namespace kvx
