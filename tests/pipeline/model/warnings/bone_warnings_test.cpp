// Bones that are doubtful for the same reason share a line, uncertain ones share one, good ones have none.
#include "pipeline/model/warnings/bone_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kvx {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// Four balls of 20 mm among voxels of 2 mm; a turn by 1.5 degrees moves their surfaces by 0.26 mm.
BoneSet FourBalls() {
  BoneSet set;
  set.labels.grid.spacing_mm = {2, 2, 2};
  for (const char* name : {"femur", "tibia", "patella", "fibula"})
    set.bones.push_back({.name = name, .voxels = 1000, .box = {.extent_mm = {20, 20, 20}}});
  return set;
}

BoneFit TurnKnownTo(double sd_deg) {
  BoneFit fit;
  fit.covariance(0, 0) = std::pow(RadFromDeg(sd_deg), 2);
  return fit;
}

BoneFit Lost() {
  BoneFit fit;
  fit.doubt = Doubt::kBone;
  fit.note = "not found; give a hint";
  return fit;
}

TEST(BoneWarnings, SayWhatIsDoubtfulAndWhatIsUncertain) {
  const BoneFits fits{TurnKnownTo(0.1), TurnKnownTo(1.2), Lost(), TurnKnownTo(1.1)};
  EXPECT_THAT(BoneWarnings("pose01", FourBalls(), fits),
              ElementsAre(AllOf(HasSubstr("'pose01', bone 'patella' is doubtful: not found"),
                                Not(HasSubstr("tibia"))),
                          AllOf(HasSubstr("'pose01'"), HasSubstr("initial poses"), HasSubstr("tibia, fibula"),
                                Not(HasSubstr("femur")))));
}

TEST(BoneWarnings, SayWhatToDoAboutUncertainBonesWhereThereAreAny) {
  const BoneFits sure(4, TurnKnownTo(0.1));
  EXPECT_EQ(UncertainBonesAdvice(FourBalls(), {sure, BoneFits(4, Lost())}), "") << "their notes say it";
  BoneFits one = sure;
  one[2] = TurnKnownTo(1.2);
  EXPECT_THAT(UncertainBonesAdvice(FourBalls(), {sure, one, one}), HasSubstr("initial_poses"));
}

TEST(BoneWarnings, ThoseInDoubtForOneReasonShareALine) {
  const auto because = [](const std::string& note) {
    BoneFit fit = Lost();
    fit.note = note;
    return fit;
  };
  const BoneFits fits{because("how the bone is turned is not known"), because("not found"),
                      because("how the bone is turned is not known"), because("how 'tibia' moves")};
  EXPECT_THAT(
      BoneWarnings("pose01", FourBalls(), fits),
      ElementsAre(HasSubstr("most of its bones are in doubt"),
                  "scan 'pose01', bones 'femur', 'patella' are doubtful: how the bone is turned is not known",
                  "scan 'pose01', bone 'tibia' is doubtful: not found",
                  "scan 'pose01', bone 'fibula' is doubtful: how 'tibia' moves"));
}

// What is doubted of a scan is said once, not of each of its bones.
TEST(BoneWarnings, AScanThatDoesNotBelongHasOneLine) {
  BoneFits fits(4, TurnKnownTo(1.2));
  DoubtAll(Doubt::kMirrored, "it is the other knee", fits);
  EXPECT_THAT(BoneWarnings("pose01", FourBalls(), fits), ElementsAre("scan 'pose01': it is the other knee"));
  fits = {Lost(), Lost(), Lost(), TurnKnownTo(0.1)};
  EXPECT_THAT(BoneWarnings("pose01", FourBalls(), fits),
              ElementsAre(HasSubstr("most of its bones are in doubt"),
                          HasSubstr("bones 'femur', 'tibia', 'patella' are doubtful: not found")));
}

TEST(TemplateWarnings, WhereNoScanFitsTheTemplateIsTheOddOne) {
  BoneFits mirrored(4);
  DoubtAll(Doubt::kMirrored, "flipped", mirrored);
  EXPECT_THAT(TemplateWarnings(FourBalls(), {mirrored, BoneFits(4, Lost())}),
              ElementsAre(HasSubstr("no scan fits the template")));
  EXPECT_THAT(TemplateWarnings(FourBalls(), {mirrored, BoneFits(4)}), testing::IsEmpty());
  EXPECT_THAT(TemplateWarnings(FourBalls(), {mirrored}), testing::IsEmpty()) << "either may be odd";
}

TEST(BoneWarnings, CoarseBonesShareOneStatementOfHowFarOffTheyMayBe) {
  const BoneFits fits{TurnKnownTo(0.1), TurnKnownTo(0.6), TurnKnownTo(0.8), TurnKnownTo(0.7)};
  EXPECT_THAT(BoneWarnings("pose01", FourBalls(), fits),
              ElementsAre(AllOf(HasSubstr("'pose01'"), HasSubstr("2.0 mm"), HasSubstr("3 of 4 bones"),
                                HasSubstr("1.6 degrees"), HasSubstr("0.3 mm off"), Not(HasSubstr("tibia")))));
}

// A ball of 20 mm that was found 9 mm from its hint lies about it still; at 11 mm, or turned over, it does
// not.
TEST(BoneWarnings, HintsThatWereNotUsedAreNamedWithHowFarTheyAreOff) {
  const auto moved = [](double mm) {
    RigidTransform pose;
    pose.translation_mm.x() = mm;
    return pose;
  };
  RigidTransform over = moved(0);
  over.rotation = Eigen::AngleAxisd(RadFromDeg(120), Eigen::Vector3d::UnitY());
  const std::map<std::string, RigidTransform> hints{
      {"femur", moved(9)}, {"tibia", moved(11)}, {"patella", over}};
  EXPECT_THAT(UnusedHintWarnings("pose01", FourBalls(), BoneFits(4), hints),
              ElementsAre(AllOf(HasSubstr("'pose01'"), HasSubstr("patella (120 degrees and 0 mm)"),
                                HasSubstr("tibia (0 degrees and 11 mm)"))));
}

// A rod of 120 x 18 x 18 mm. Turned by 25 degrees about its length its surface lies 3 mm off, within half its
// thickness; tipped by as much, its ends lie 26 mm off.
TEST(BoneWarnings, HintsAreMeasuredByWhereTheyPutTheSurface) {
  BoneSet bones = FourBalls();
  for (Bone& bone : bones.bones) bone.box.extent_mm = {120, 18, 18};
  const auto turned = [&](const std::string& name, int axis) {
    const Bone& bone = bones.bones[size_t(bones.IndexOf(name))];
    return RotationAbout(bone.centroid, bone.box.axes.col(axis), RadFromDeg(25));
  };
  const PoseHints hints{{"femur", turned("femur", 0)}, {"tibia", turned("tibia", 1)}};
  EXPECT_THAT(UnusedHintWarnings("pose01", bones, BoneFits(4), hints),
              ElementsAre(AllOf(HasSubstr("tibia (25 degrees and 0 mm)"), Not(HasSubstr("femur")))));
}

TEST(BoneWarnings, SayHowMuchOfTheBodyAScanDoesNotDecide) {
  EXPECT_THAT(HiddenTissueText("pose01", 0.426), AllOf(HasSubstr("'pose01'"), HasSubstr("43 %")));
  EXPECT_THAT(HiddenTissueText("pose01", 0.002), HasSubstr("1 %"));
  EXPECT_THAT(HiddenTissueText("pose01", 1.0), HasSubstr("posing does without it"));
}

TEST(BoneWarnings, NothingInDoubtIsNothingSaid) {
  EXPECT_TRUE(BoneWarnings("pose01", FourBalls(), BoneFits(4, TurnKnownTo(0.4))).empty());
}

TEST(UnsureTissueWarnings, TellOfScansThatAreUnsureInMuchOfTheBody) {
  EXPECT_TRUE(UnsureTissueWarnings("pose01", 0.11).empty());
  EXPECT_THAT(UnsureTissueWarnings("pose01", 0.36),
              testing::ElementsAre(AllOf(HasSubstr("'pose01'"), HasSubstr("36 %"), HasSubstr("--confidence"),
                                         HasSubstr("map=confidence"))));
}

TEST(LessAlikeWarnings, TellOfScansThatEveryMeasureSaysWereLeftWorse) {
  const Measures bones{.ssd = 17.1, .cc = 0.96, .mi = 1.48}, worse{.ssd = 21.1, .cc = 0.926, .mi = 1.31};
  const auto warnings = [&](const Measures& registered) {
    return LessAlikeWarnings("pose01", {{"source", {}}, {"initialise", bones}, {"register", registered}});
  };
  EXPECT_THAT(warnings(worse), testing::ElementsAre(AllOf(HasSubstr("'pose01'"), HasSubstr("evaluate"))));
  EXPECT_TRUE(warnings({.ssd = worse.ssd, .cc = worse.cc, .mi = 1.5}).empty()) << "in another contrast";
  EXPECT_TRUE(warnings({.ssd = 17.2, .cc = 0.955, .mi = 1.47}).empty()) << "by noise";
  EXPECT_TRUE(warnings({.ssd = 5, .cc = 0.99, .mi = 2}).empty());
}

}  // namespace
}  // namespace kvx
