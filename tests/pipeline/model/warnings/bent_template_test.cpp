// A chain of long bones whose bends are known.
#include "pipeline/model/warnings/bent_template.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kvx {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

RigidTransform Turned(double deg) { return RotationAbout(PointMm{{10, 20, 30}}, {0, 0, 1}, RadFromDeg(deg)); }

// Three bones in the xy plane, of which the template bends each joint by so much about z. A round bone hangs
// on the first, turned however.
class BentTemplate : public testing::Test {
 protected:
  explicit BentTemplate(double bend_deg = 80) : bend_deg_(bend_deg) {
    for (const char* name : {"hand", "base", "tip", "pebble"}) {
      const int b = bones_.size(), parent = b == 3 ? 0 : b - 1;
      Bone bone{.label = b + 1, .name = name, .parent = parent, .voxels = 500};
      bone.box.axes =
          Eigen::AngleAxisd(RadFromDeg(b * bend_deg), Eigen::Vector3d::UnitZ()).toRotationMatrix();
      bone.box.extent_mm = b == 3 ? Eigen::Vector3d(15, 12, 12) : Eigen::Vector3d(40, 12, 10);
      bones_.bones.push_back(bone);
      Joint joint{.child = b, .parent = parent};
      if (b > 0) joint.dofs.push_back({"flexion", Eigen::Vector3d::UnitZ(), 0, 0});
      skeleton_.joints.push_back(joint);
    }
  }
  // The scan bends the joints by so much, where the template bends them by `bend_deg`.
  BoneFits Bent(double base_deg, double tip_deg) const {
    BoneFits fits(4);
    fits[0].scan_from_template = Turned(30);
    fits[1].scan_from_template = fits[0].scan_from_template * Turned(base_deg - bend_deg_);
    fits[2].scan_from_template = fits[1].scan_from_template * Turned(tip_deg - bend_deg_);
    fits[3].scan_from_template = Turned(-90);
    return fits;
  }
  std::vector<std::string> Said(const std::vector<BoneFits>& scans) const {
    return BentTemplateWarnings("fist", bones_, skeleton_, {"flat", "half", "tight"}, scans);
  }

  double bend_deg_;
  BoneSet bones_;
  Skeleton skeleton_;
};

TEST_F(BentTemplate, NamesTheStraightestScan) {
  EXPECT_THAT(Said({Bent(10, 30), Bent(60, 60)}),
              ElementsAre(AllOf(HasSubstr("'fist' is bent more than every scan"),
                                HasSubstr("'flat' is straighter by 60 degrees"))));
}

TEST_F(BentTemplate, SaysNothingWhereSomeScanIsBentAsMuch) {
  EXPECT_THAT(Said({Bent(10, 30), Bent(60, 60), Bent(80, 75)}), IsEmpty());
  EXPECT_THAT(Said({Bent(10, 30), Bent(60, 60), Bent(120, 90)}), IsEmpty());
}

TEST_F(BentTemplate, SaysNothingOfAFewDegrees) {
  EXPECT_THAT(Said({Bent(50, 50)}), IsEmpty()) << "no joint by 45 degrees";
  EXPECT_THAT(Said({Bent(28, 80)}), ElementsAre(HasSubstr("by 26 degrees"))) << "52 and 0";
  EXPECT_THAT(Said({Bent(32, 82)}), IsEmpty()) << "48 and -2";
  EXPECT_THAT(Said({}), IsEmpty());
}

TEST_F(BentTemplate, GoesByBonesThatAreNotDoubtful) {
  BoneFits scan = Bent(80, 10);
  EXPECT_THAT(Said({scan}), ElementsAre(HasSubstr("by 35 degrees")));
  scan[2].doubt = Doubt::kBone;
  EXPECT_THAT(Said({scan}), IsEmpty());
  for (Joint& joint : skeleton_.joints) joint.dofs.clear();
  EXPECT_THAT(Said({Bent(10, 10)}), IsEmpty()) << "fixed";
}

class StraightTemplate : public BentTemplate {
 protected:
  StraightTemplate() : BentTemplate(5) {}
};

TEST_F(StraightTemplate, IsTheUsualOne) {
  EXPECT_THAT(Said({Bent(60, 80), Bent(90, 40)}), IsEmpty());
  EXPECT_THAT(Said({Bent(-60, -80)}), IsEmpty()) << "the other way";
}

}  // namespace
}  // namespace kvx
