#include "pipeline/model/posed_series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace kvx {
namespace {
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::vector<std::string> kScans{"pose01", "Jane_Doe"};

AnglePose Flexed(double degrees) { return {{{"tibia.flexion", RadFromDeg(degrees)}}}; }

TEST(PosedSeries, PosesOfAModelAreToldApart) {
  RigidTransform turned;
  turned.rotation = Eigen::AngleAxisd(RadFromDeg(30), Eigen::Vector3d::UnitX());
  std::set<std::string> seen;
  for (const PosedAs& posed :
       {PosedAs{Flexed(20)}, PosedAs{Flexed(60)}, PosedAs{Flexed(60), DeformationMode::kVbd},
        PosedAs{Flexed(60), DeformationMode::kEvd, 2}, PosedAs{AnglePose{}}, PosedAs{ScanPose{"pose01"}},
        PosedAs{ScanPose{"Jane_Doe"}}, PosedAs{BonePose{{{"tibia", turned}}}}}) {
    EXPECT_TRUE(seen.insert(TextOf(posed, kScans).description).second);
  }
  EXPECT_EQ(TextOf({Flexed(35)}, kScans).description, "Kinevox tibia.flexion=35");
  EXPECT_EQ(TextOf({Flexed(35), DeformationMode::kVbd, 2}, kScans).description,
            "Kinevox tibia.flexion=35 vbd level 2");
  EXPECT_EQ(TextOf({BonePose{{{"tibia", turned}}}}, kScans).description, "Kinevox tibia turned 30");
}

TEST(PosedSeries, WhatIsExtrapolatedSaysSoFirst) {
  const SeriesText text = TextOf({Flexed(140), DeformationMode::kEvd, 0, 1.456}, kScans);
  EXPECT_EQ(text.description, "EXTRAPOLATED 1.46 Kinevox tibia.flexion=140");
  EXPECT_THAT(text.comment, HasSubstr("Extrapolation 1.46"));
  EXPECT_THAT(TextOf({Flexed(20), DeformationMode::kEvd, 0, 0.004}, kScans).description,
              StartsWith("Kinevox"))
      << "0.00 is inside, as the service's header says";
}

TEST(PosedSeries, AScanGoesByItsNumber) {
  const SeriesText text = TextOf({ScanPose{"Jane_Doe"}}, kScans);
  EXPECT_EQ(text.description, "Kinevox scan 2");
  EXPECT_THAT(text.comment, Not(HasSubstr("Jane")));
  EXPECT_EQ(TextOf({ScanPose{"the_template"}}, kScans).description, "Kinevox template pose");
}

TEST(PosedSeries, TheCommentHasTheWholePoseThatTheDescriptionCutsShort) {
  AnglePose pose;
  for (int finger = 1; finger <= 20; ++finger)
    pose.angles_rad["phalanx_" + std::to_string(finger) + ".flexion"] = RadFromDeg(finger + 0.5);
  const SeriesText text = TextOf({pose, DeformationMode::kVbd, 3, 12.5}, kScans);
  EXPECT_LE(text.description.size(), 64u);
  EXPECT_THAT(text.description, StartsWith("EXTRAPOLATED 12.50 Kinevox phalanx_1"));
  EXPECT_THAT(text.description, HasSubstr(" +19 vbd level 3"));
  EXPECT_THAT(text.comment, HasSubstr("For research"));
  EXPECT_THAT(text.comment, HasSubstr("phalanx_20.flexion=20.5"));
  EXPECT_THAT(text.comment, HasSubstr("Mode vbd, level 3"));
}

TEST(PosedSeries, NothingIsLongerThanDicomAllows) {
  BonePose bones;
  AnglePose angles;
  for (int n = 100; n < 400; ++n) {
    const std::string name = std::string(61, 'b') + std::to_string(n);
    bones.scan_from_template[name] = RigidTransform{};
    angles.angles_rad[name + ".flexion"] = RadFromDeg(n);
  }
  for (const PoseRequest& request : {PoseRequest(bones), PoseRequest(angles)}) {
    const SeriesText text = TextOf({request, DeformationMode::kVbd, 5, 1e300}, kScans);
    EXPECT_LE(text.description.size(), 64u) << text.description;
    EXPECT_LE(text.comment.size(), 10240u);
    EXPECT_GT(text.comment.size(), 9900u);
    EXPECT_THAT(text.description, HasSubstr("+299"));
  }
}

}  // namespace
}  // namespace kvx
