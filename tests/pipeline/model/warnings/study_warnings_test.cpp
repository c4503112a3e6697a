// Files chosen twice, labels that nobody named and bones in air are told; a good study is not.
#include "pipeline/model/warnings/study_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

// Two bars of 4 x 2 x 2 voxels, labels 3 and 7.
BoneSet TwoBars() {
  BoneSet set;
  set.labels = LabelMap(testing_support::ObliqueGrid({10, 8, 6}));
  for (int k = 2; k < 4; ++k) {
    for (int j = 2; j < 4; ++j) {
      for (int i = 3; i < 7; ++i) set.labels(i, j, k) = 3, set.labels(i, j + 3, k) = 7;
    }
  }
  set.bones = {{.label = 3, .name = "femur", .voxels = 16}, {.label = 7, .name = "tibia", .voxels = 16}};
  return set;
}

TEST(SameScanWarnings, NameThoseThatShareAFile) {
  const auto file = [](const char* bytes) { return Hasher().Add(bytes).Finish(); };
  EXPECT_THAT(SameScanWarnings({{"rest", file("1")}, {"bent", file("2")}}), IsEmpty());
  EXPECT_THAT(SameScanWarnings({{"rest", file("1")}, {"bent", file("2")}, {"fist", file("1")}}),
              ElementsAre(testing::EndsWith("chosen twice? 'rest', 'fist'")));
}

TEST(ModalityWarnings, NameWhatDoesNotGoTogether) {
  EXPECT_THAT(ModalityWarnings({{"rest", true}, {"bent", true}}), IsEmpty());
  EXPECT_THAT(ModalityWarnings({{"rest", false}, {"bent", false}}), IsEmpty());
  EXPECT_THAT(ModalityWarnings({{"rest", true}, {"bent", false}}),
              ElementsAre(AllOf(HasSubstr("CT ('rest')"), HasSubstr("not ('bent')"))));
}

TEST(ScanWarnings, SayWhatWasDoneToADeniedCtAndToUnevenSlices) {
  Scan scan;
  EXPECT_THAT(ScanWarnings("the scan", scan), IsEmpty());
  scan.denied_ct = true;
  EXPECT_THAT(ScanWarnings("the scan", scan),
              ElementsAre(AllOf(StartsWith("the scan: its file says CT"), HasSubstr("rescale slope"))));
  scan.denied_ct = false, scan.evened_slices = 0.25;
  EXPECT_THAT(ScanWarnings("the scan", scan),
              ElementsAre(StartsWith("the scan: every other slice was 25 %")));
}

TEST(TemplatePoseWarnings, NameBonesThatAreMovedInTheTemplate) {
  Study study;
  study.template_scan = "rest";
  study.initial_poses["bent"]["tibia"].translation_mm.x() = 5;
  EXPECT_THAT(TemplatePoseWarnings(study), IsEmpty());
  study.initial_poses["rest"]["femur"].translation_mm.x() = 1e-9;
  EXPECT_THAT(TemplatePoseWarnings(study), IsEmpty()) << "where it lies";
  study.initial_poses["rest"]["tibia"].translation_mm.x() = 0.1;
  EXPECT_THAT(TemplatePoseWarnings(study), ElementsAre(testing::EndsWith("another scan: tibia")));
}

// A SEG of femur and patella numbers them 1 and 2, and 2 is the preset's tibia.
TEST(SegmentNameWarnings, NameBonesThatTheFileCallsByAnothersName) {
  const BoneSet set = TwoBars();
  EXPECT_THAT(SegmentNameWarnings(set, {}, Region::kKnee), IsEmpty());
  EXPECT_THAT(SegmentNameWarnings(set, {{3, "Femur"}, {7, "Segment_2"}, {9, "patella"}}, Region::kKnee),
              IsEmpty());
  EXPECT_THAT(SegmentNameWarnings(set, {{3, "femur"}, {7, "Patella"}}, Region::kKnee),
              ElementsAre(testing::EndsWith(": tibia (label 7, there patella)")));
  EXPECT_THAT(SegmentNameWarnings(set, {{3, "tibia"}, {7, "patella"}}, Region::kCustom),
              ElementsAre(testing::EndsWith(": femur (label 3, there tibia)")));
}

TEST(LabelWarnings, NameLabelsOfNoBone) {
  BoneSet set = TwoBars();
  EXPECT_THAT(LabelWarnings(set), IsEmpty());
  set.mending.unused_labels = {5, 12};
  EXPECT_THAT(LabelWarnings(set), ElementsAre(testing::EndsWith(": 5, 12")));
  for (int label = 100; label < 120; ++label) set.mending.unused_labels.push_back(label);
  EXPECT_THAT(LabelWarnings(set), ElementsAre(AllOf(HasSubstr(": 5, 12, 100"), HasSubstr("and 10 more"))));
}

TEST(LabelWarnings, SayOfWhichBonesAndHowManyVoxels) {
  BoneSet set = TwoBars();
  set.mending = {{}, {0, 3}, {1, 0}, {0, 2}};
  EXPECT_THAT(LabelWarnings(set),
              ElementsAre(AllOf(HasSubstr("stray"), testing::EndsWith(": tibia (3)")),
                          AllOf(HasSubstr("encloses"), testing::EndsWith(": femur (1)")),
                          AllOf(HasSubstr("masks share"), testing::EndsWith(": tibia (2)"))));
}

// Three bars in a row, 6 mm from voxel to voxel: the third hangs on the second, or, wrongly, on the first.
TEST(ParentWarnings, NameBonesThatHangOnOneFarAway) {
  BoneSet set;
  Grid grid;
  grid.size = {16, 5, 5};
  grid.spacing_mm.setConstant(3);
  set.labels = LabelMap(grid);
  for (int b = 0; b < 3; ++b) {
    for (int i = 0; i < 4; ++i) set.labels(5 * b + i, 2, 2) = uint16_t(b + 1);
    set.bones.push_back(
        {.label = b + 1, .name = std::string(1, char('a' + b)), .parent = b - 1, .voxels = 4});
  }
  EXPECT_THAT(ParentWarnings(set, Region::kCustom), IsEmpty());
  set.bones[2].parent = 0;
  EXPECT_THAT(ParentWarnings(set, Region::kCustom), ElementsAre(testing::EndsWith(": c (a is 21 mm away)")));
}

// A femur that ends at a plate 14 mm before the tibia, which a fibula 2 mm beside it does not make right.
TEST(ParentWarnings, AskForTheEndsOfBonesThatShouldMeet) {
  BoneSet set;
  Grid grid;
  grid.size = {4, 5, 40};
  grid.spacing_mm.setOnes();
  set.labels = LabelMap(grid);
  const std::array<std::string, 3> names = {"femur", "tibia", "fibula"};
  const std::array parents = {kNoParent, 0, 1};
  for (int b = 0; b < 3; ++b)
    set.bones.push_back({.label = b + 1, .name = names[size_t(b)], .parent = parents[size_t(b)]});
  for (int k = 0; k < 10; ++k) set.labels(1, 1, k) = 1;
  for (int k = 24; k < 40; ++k) set.labels(1, 1, k) = 2, set.labels(3, 1, k) = 3;
  const auto asked =
      ElementsAre(AllOf(HasSubstr("growth plate"), testing::EndsWith("? tibia (femur is 14 mm away)")));
  EXPECT_THAT(ParentWarnings(set, Region::kKnee), asked);
  EXPECT_THAT(ParentWarnings(set, Region::kCustom), IsEmpty()) << "bones need not meet";
  for (int k = 10; k < 14; ++k) set.labels(1, 1, k) = 1;
  EXPECT_THAT(ParentWarnings(set, Region::kKnee), IsEmpty()) << "a wide joint";
}

TEST(BonesOutsideBody, AreThoseThatLieInAir) {
  const BoneSet set = TwoBars();
  Mask body(set.labels.grid, 1);
  EXPECT_THAT(BonesOutsideBody(set, body), IsEmpty());
  body(3, 5, 2) = 0;
  EXPECT_THAT(BonesOutsideBody(set, body), IsEmpty()) << "a sixteenth may be the border";
  for (int k = 2; k < 4; ++k) {
    for (int j = 5; j < 7; ++j) body(3, j, k) = 0;
  }
  EXPECT_THAT(BonesOutsideBody(set, body),
              ElementsAre(AllOf(HasSubstr("tibia (25 %)"), Not(HasSubstr("femur")))));
}

TEST(TissueBesideBody, IsAsBrightAsTheBodyAndMoreThanATenthOfIt) {
  const Grid grid = testing_support::ObliqueGrid({40, 10, 6});
  Volume scan(grid);
  Mask body(grid);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const int i = grid.Ijk(v).x();
    body.values[v] = i < 20;
    scan.values[v] = i < 20 ? float(50 + v % 97) : 5.0f;
  }
  EXPECT_THAT(TissueBesideBody(scan, body), IsEmpty());
  const auto show = [&](int from, int to, float value) {
    for (size_t v = 0; v < scan.values.size(); ++v) {
      if (grid.Ijk(v).x() >= from && grid.Ijk(v).x() < to) scan.values[v] = value;
    }
  };
  show(22, 24, 120);
  EXPECT_THAT(TissueBesideBody(scan, body), IsEmpty()) << "a tenth";
  show(22, 40, 60);
  EXPECT_THAT(TissueBesideBody(scan, body), IsEmpty()) << "a ghost";
  show(22, 25, 120);
  EXPECT_THAT(TissueBesideBody(scan, body), ElementsAre(HasSubstr("another limb?")));
}

TEST(MissingBoneWarnings, NameWhatTheRegionHasAndTheMapHasNot) {
  BoneSet set = TwoBars();  // femur and tibia
  EXPECT_THAT(MissingBoneWarnings(set, Region::kKnee), ElementsAre(testing::EndsWith(": fibula, patella")));
  set.bones[0].name = "Femur", set.bones[1].name = "TIBIA";
  EXPECT_THAT(MissingBoneWarnings(set, Region::kKnee), ElementsAre(testing::EndsWith(": fibula, patella")))
      << "names count in any case";
  EXPECT_THAT(MissingBoneWarnings(set, Region::kCustom), IsEmpty());
  EXPECT_THAT(MissingBoneWarnings(set, Region::kHand), IsEmpty()) << "another region's names, or one's own";
  for (const char* name : {"fibula", "patella"}) set.bones.push_back({.label = 9, .name = name, .parent = 0});
  EXPECT_THAT(MissingBoneWarnings(set, Region::kKnee), IsEmpty());
}

// A ball of 7 voxels' radius around the middle of the view; its map lies there, or three voxels beside.
TEST(MisplacedLabelWarnings, SayHowFarTheMapIsMovedAndWhereItBelongs) {
  const Grid grid = testing_support::ObliqueGrid({36, 36, 36});
  Volume scan(grid);
  LabelMap labels(grid), beside(grid);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i from_middle = grid.Ijk(v) - Eigen::Vector3i::Constant(18);
    const Eigen::Vector3i from_beside = from_middle - Eigen::Vector3i(0, 3, 0);
    scan.values[v] = from_middle.norm() <= 7 ? 20.0f : 100.0f;
    labels.values[v] = from_middle.norm() <= 7, beside.values[v] = from_beside.norm() <= 7;
  }
  EXPECT_THAT(MisplacedLabelWarnings(scan, labels), IsEmpty());
  EXPECT_THAT(MisplacedLabelWarnings(scan, beside), ElementsAre(HasSubstr("moved by (0, -3, 0) voxels")));
  EXPECT_THAT(MisplacedLabelWarnings(Volume(grid, 7.0f), labels), ElementsAre(HasSubstr("follow no edges")))
      << "a scan without any";
}

TEST(NoAirWarnings, SayThatAllOfTheGridIsBody) {
  Mask body(testing_support::ObliqueGrid(), 1);
  EXPECT_THAT(NoAirWarnings(body), ElementsAre(HasSubstr("no air was found")));
  body.values[3] = 0;
  EXPECT_TRUE(NoAirWarnings(body).empty());
}

}  // namespace
}  // namespace kvx
