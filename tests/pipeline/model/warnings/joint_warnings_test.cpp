// Joints that the scans say little of, or contradict, are told; those of a good study are not.
#include "pipeline/model/warnings/joint_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace kvx {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;

// A finger of four bones in two scans, with limits as if they turned by so many degrees at most.
class JointWarnings : public testing::Test {
 protected:
  static constexpr double kMarginRad = RadFromDeg(5);

  JointWarnings() {
    for (const char* name : {"hand", "base", "middle", "end"}) {
      const int b = bones_.size();
      bones_.bones.push_back({.label = b + 1, .name = name, .parent = b - 1, .voxels = 500});
      fit_.skeleton.joints.push_back({.child = b, .parent = b - 1});
    }
    fit_.scan_residuals.assign(2, std::vector<Twist>(4, Twist::Zero()));
    plans_[2].parallel = {{1, RadFromDeg(5)}}, plans_[3].parallel = {{2, RadFromDeg(5)}};
  }
  void Turns(int bone, const std::string& dof, double by_deg) {
    plans_[size_t(bone)].dofs.push_back(dof);
    fit_.skeleton.joints[size_t(bone)].dofs.push_back(
        {dof, Eigen::Vector3d::UnitZ(), -kMarginRad, RadFromDeg(by_deg) + kMarginRad});
  }
  std::vector<std::string> Still() const {
    return StillJointWarnings(bones_, plans_, fit_.skeleton, kMarginRad, scans_);
  }
  std::vector<std::string> Straying() const { return StrayingJointWarnings(bones_, plans_, fit_, scans_); }

  BoneSet bones_;
  std::vector<JointPlan> plans_{4};
  SkeletonFit fit_;
  std::vector<BoneFits> scans_ = std::vector<BoneFits>(2, BoneFits(4));
};

TEST_F(JointWarnings, NameDegreesOfFreedomThatNoScanTurns) {
  Turns(1, "flexion", 30), Turns(1, "abduction", 4.9);
  EXPECT_THAT(Still(), ElementsAre(AllOf(HasSubstr("the bones' shapes"), EndsWith(": base.abduction"))));
  fit_.skeleton.joints[1].dofs[1].min_rad = -RadFromDeg(5.1) - kMarginRad;
  EXPECT_THAT(Still(), IsEmpty());
}

TEST_F(JointWarnings, SayWhereTheAxisOfAStillJointComesFrom) {
  Turns(1, "flexion", 1), Turns(2, "flexion", 40), Turns(3, "flexion", 2);
  EXPECT_THAT(Still(),
              ElementsAre(AllOf(HasSubstr("near parallel"), EndsWith(": base.flexion, end.flexion"))));
  plans_[3].parallel.clear();
  EXPECT_THAT(Still(), ElementsAre(AllOf(HasSubstr("shapes"), EndsWith(": end.flexion")),
                                   AllOf(HasSubstr("near parallel"), EndsWith(": base.flexion"))));
}

TEST_F(JointWarnings, DoNotSayThatAnAxisComesFromAJointOfThree) {
  for (const char* dof : {"flexion", "abduction", "rotation"}) Turns(1, dof, 30);
  Turns(2, "flexion", 2);
  EXPECT_THAT(Still(), ElementsAre(AllOf(HasSubstr("shapes"), EndsWith(": middle.flexion"))));
}

TEST_F(JointWarnings, SayThatAJointIsNotShownSurely) {
  Turns(1, "flexion", 30);
  scans_[0][1].doubt = scans_[1][0].doubt = Doubt::kBone;
  EXPECT_THAT(Still(), ElementsAre(AllOf(HasSubstr("doubtful in every scan"), EndsWith(": base"))));
  scans_[1][0].doubt = Doubt::kNone;
  EXPECT_THAT(Still(), IsEmpty());
}

TEST_F(JointWarnings, NameBonesThatMoveAsTheirJointsCannot) {
  Turns(1, "flexion", 30);
  Joint& joint = fit_.skeleton.joints[1];
  joint.centre.lps = {100, 20, -30};
  const auto leave = [&](double turn_deg, double shift_mm) {
    RigidTransform left = RotationAbout(joint.centre, Eigen::Vector3d::UnitX(), RadFromDeg(turn_deg));
    left.translation_mm.z() += shift_mm;
    fit_.scan_residuals[1][1] = Log(left);
  };
  leave(4.9, 2.9);
  EXPECT_THAT(Straying(), IsEmpty()) << "a joint's play";
  leave(5.1, 0);
  EXPECT_THAT(Straying(), ElementsAre(EndsWith(": base (by up to 5 degrees and 0 mm)")));
  leave(0, 3.1);
  EXPECT_THAT(Straying(), ElementsAre(EndsWith(": base (by up to 0 degrees and 3 mm)")));
  leave(78, 0.6);
  EXPECT_THAT(Straying(),
              ElementsAre(AllOf(HasSubstr("at the scans' own angles"), HasSubstr("3 or 6 degrees"),
                                EndsWith(": base (by up to 78 degrees and 1 mm)"))));
  joint.dofs.clear(), joint.drivers = {2};
  EXPECT_THAT(Straying(), IsEmpty()) << "a dependent bone";
  joint.drivers.clear();
  EXPECT_THAT(Straying(), ElementsAre(AllOf(HasSubstr("no angle asks for that"), HasSubstr("base"))))
      << "fixed, and moves";
}

// The published preset's knee has one degree of freedom; a healthy one turns by 4 to 10 degrees about its
// shank, too, and rolls back.
TEST_F(JointWarnings, DoNotTellOfTheConjunctRotationOfAPresetsJoint) {
  Turns(1, "flexion", 90);
  plans_[1].conjunct_rotation = true;
  const auto leave = [&](double turn_deg, double shift_mm) {
    fit_.scan_residuals[1][1] = (Twist() << RadFromDeg(turn_deg), 0, 0, 0, 0, shift_mm).finished();
  };
  leave(9.9, 4.9);
  EXPECT_THAT(Straying(), IsEmpty());
  leave(10.1, 0);
  EXPECT_THAT(Straying(), ElementsAre(HasSubstr("base (by up to 10 degrees")));
  leave(0, 5.1);
  EXPECT_THAT(Straying(), ElementsAre(EndsWith("base (by up to 0 degrees and 5 mm)")));
  leave(6, 0);
  fit_.skeleton.joints[1].dofs.clear();
  EXPECT_THAT(Straying(), ElementsAre(HasSubstr("base (by up to 6 degrees"))) << "fixed";
}

TEST_F(JointWarnings, DoNotTellWhatBonesThatAreNotSureLeaveOpen) {
  Turns(1, "flexion", 30);
  fit_.scan_residuals[1][1] = (Twist() << RadFromDeg(8), 0, 0, 0, 0, 0).finished();
  EXPECT_THAT(Straying(), ElementsAre(HasSubstr("base (by up to 8 degrees")));
  scans_[1][0].covariance(0, 0) = std::pow(RadFromDeg(10), 2);
  EXPECT_THAT(Straying(), IsEmpty()) << "within the bounds of its parent";
  scans_[1][0].covariance(0, 0) = 0;
  scans_[1][1].doubt = Doubt::kBone;
  EXPECT_THAT(Straying(), IsEmpty());
}

}  // namespace
}  // namespace kvx
