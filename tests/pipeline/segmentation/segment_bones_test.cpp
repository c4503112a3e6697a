// What is told of segmented bones, and by which names.
#include "pipeline/segmentation/segment_bones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dice.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

SegmentedBones TwoKneeBones() {
  Grid grid;
  grid.size = {12, 12, 40};
  SegmentedBones bones{.labels = LabelMap(grid), .expected_dice = {{2, 0.71}}};
  for (int k = 0; k < 40; ++k) bones.labels(6, 6, k) = k < 18 ? 1 : k > 20 ? 2 : 0;
  bones.warnings.emplace_back("the whole: look at it");
  bones.doubts.emplace_back(2, "look at it");
  bones.doubts.emplace_back(1, "and at this");
  return bones;
}

TEST(SegmentBones, BonesAreToldOfByTheNamesThatAreSure) {
  const SegmentedBones bones = TwoKneeBones();
  EXPECT_THAT(WarningsOf(bones, std::map<int, std::string>{{1, "femur"}}),
              testing::ElementsAre("the whole: look at it", "bone 2: look at it", "bone femur: and at this"));
  const std::vector<ProposedBone> named{{.label = 1, .name = "femur", .confidence = 0.4},
                                        {.label = 2, .name = "tibia", .confidence = 0.6}};
  EXPECT_THAT(WarningsOf(bones, named),
              testing::ElementsAre("the whole: look at it", "bone tibia: look at it", "bone 1: and at this"));
}

TEST(SegmentBones, ADoubtOfSeveralBonesIsToldOnce) {
  SegmentedBones bones = TwoKneeBones();
  bones.doubts.emplace_back(4, "look at it");
  EXPECT_THAT(
      WarningsOf(bones, std::map<int, std::string>{{2, "tibia"}}),
      testing::ElementsAre("the whole: look at it", "bones tibia, 4: look at it", "bone 1: and at this"));
}

TEST(SegmentBones, WhatIsExpectedOfABoneIsToldWithItsName) {
  const std::vector<ProposedBone> named = NamesOf(TwoKneeBones(), Region::kKnee);
  ASSERT_EQ(named.size(), 2u);
  EXPECT_FALSE(named[0].expected_dice);
  EXPECT_EQ(named[1].expected_dice, 0.71);
}

TEST(SegmentBones, AScanIsNoPreviousLabelMap) {
  const testing_support::ScratchFolder folder;
  const auto file = folder.path() / "previous.nrrd";
  LabelMap map = TwoKneeBones().labels;
  WriteLabels(file, map);
  EXPECT_EQ(ReadPreviousLabels(file, map.grid).values, map.values);
  for (size_t v = 0; v < map.values.size(); ++v) map.values[v] = uint16_t(v * 2654435761u >> 7 & 255);
  WriteLabels(file, map);
  EXPECT_THAT(testing_support::RefusalOf<InputError>([&] { ReadPreviousLabels(file, map.grid); }),
              testing::HasSubstr("previous label map holds greys"));
}

// Two balls of marrow in dark shells, and a line through each; the first line's middle is the second's, too.
TEST(SegmentBones, StrokesThatShareVoxelsAreToldOf) {
  Grid grid;
  grid.size = {30, 16, 16};
  Scan scan{.volume = Volume(grid), .modality = "MR"};
  std::string layers;  // two, voxel by voxel
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    const Eigen::Vector3i at = grid.Ijk(v);
    const double away = std::min((at - Eigen::Vector3i(8, 8, 8)).cast<double>().norm(),
                                 (at - Eigen::Vector3i(21, 8, 8)).cast<double>().norm());
    scan.volume.values[v] = away < 5 ? 100 : away < 6.5 ? 5 : 50;
    const bool lines = at.y() == 8 && at.z() == 8;
    layers += char(lines && std::abs(at.x() - 8) <= 2);
    layers += char(lines && (std::abs(at.x() - 21) <= 2 || at.x() == 8));
  }
  const testing_support::ScratchFolder folder;
  std::ofstream(folder.path() / "strokes.seg.nrrd", std::ios::binary)
      << "NRRD0004\ntype: unsigned char\ndimension: 4\nsizes: 2 30 16 16\nspacings: nan 1 1 1\nencoding: "
         "raw\n"
      << "kinds: list domain domain domain\nSegment0_ID:=a\nSegment1_ID:=b\n\n"
      << layers;
  StageContext context{testing_support::SharedBackend(), {}};
  const Artifact<Scan> loaded{{}, std::make_shared<const Scan>(std::move(scan))};
  const SegmentedBones bones =
      SegmentBones::Run({loaded, {}, folder.path() / "strokes.seg.nrrd"}, {}, context);
  EXPECT_EQ(bones.labels(8, 8, 8), 1) << "the first segment's";
  EXPECT_EQ(bones.labels(21, 8, 8), 2);
  EXPECT_THAT(WarningsOf(bones, std::map<int, std::string>{}),
              testing::Contains(testing::StartsWith("bone 2: some of its strokes' voxels")));
}

// A real CT of a wrist's bones (greys are HU + 1024, 0 around), cut out and laid into soft tissue, with air
// at one side, and a table of so many voxels in it.
struct RealBones {
  Scan scan;
  LabelMap truth;  // one label for all

  explicit RealBones(const std::string& name, int table = 0) {
    const Volume crop =
        ReadScan(testing_support::SharedData() / "wrist-bone-ct-crops" / (name + ".nii.gz")).volume;
    constexpr int kMargin = 12;
    Grid grid = crop.grid;
    grid.size += Eigen::Vector3i(2 * kMargin, 2 * (kMargin + table), 4);
    scan.volume = Volume(grid, 40.0f);
    truth = LabelMap(grid);
    for (size_t v = 0; v < truth.values.size(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v) - Eigen::Vector3i(kMargin, kMargin + 2 * table, 2);
      if (p.y() < 4 - kMargin) scan.volume.values[v] = -1000;
      if (grid.Ijk(v).y() < table) scan.volume.values[v] = 1100;
      if (!crop.grid.Contains(p) || crop(p.x(), p.y(), p.z()) <= 0) continue;
      scan.volume.values[v] = crop(p.x(), p.y(), p.z()) - 1024;
      truth.values[v] = 1;
    }
  }
  SegmentedBones ByThreshold() const {
    StageContext context{testing_support::SharedBackend(), {}};
    const Artifact<Scan> loaded{{}, std::make_shared<const Scan>(scan)};
    return SegmentBones::Run({.scan = loaded, .strokes_content = {}, .strokes_path = {}}, {}, context);
  }
};

std::vector<size_t> VoxelsByLabel(const LabelMap& labels) {
  std::vector<size_t> voxels(size_t(*std::ranges::max_element(labels.values)) + 1, 0);
  for (const uint16_t label : labels.values) ++voxels[label];
  return voxels;
}

TEST(SegmentBones, ARealBoneWithMarrowAndSpongyEndsIsOneByThreshold) {
  if (!testing_support::HasSharedData()) GTEST_SKIP() << "no shared data here";
  const RealBones metacarpal("mc3");
  const SegmentedBones found = metacarpal.ByThreshold();
  EXPECT_THAT(found.warnings, testing::IsEmpty());
  EXPECT_EQ(VoxelsByLabel(found.labels).size(), 2u);
  EXPECT_GT(testing_support::Dice(found.labels, metacarpal.truth, 1), 0.97);
}

TEST(SegmentBones, ATableIsToldAndIsNoBone) {
  if (!testing_support::HasSharedData()) GTEST_SKIP() << "no shared data here";
  const RealBones metacarpal("mc3", 16);
  const SegmentedBones found = metacarpal.ByThreshold();
  EXPECT_THAT(found.warnings, testing::ElementsAre(testing::HasSubstr("as a table or a cast does")));
  EXPECT_EQ(VoxelsByLabel(found.labels).size(), 2u);
  EXPECT_GT(testing_support::Dice(found.labels, metacarpal.truth, 1), 0.97);
}

TEST(SegmentBones, RealBonesSideBySideAreTwoByThreshold) {
  if (!testing_support::HasSharedData()) GTEST_SKIP() << "no shared data here";
  const RealBones metacarpals("mc2_mc3");
  const LabelMap found = metacarpals.ByThreshold().labels;
  const std::vector<size_t> voxels = VoxelsByLabel(found);
  ASSERT_EQ(voxels.size(), 3u);
  EXPECT_GT(double(voxels[2]), 0.8 * double(voxels[1])) << "one is about as large as the other";
  LabelMap all = found;
  for (uint16_t& label : all.values) label = label != 0;
  EXPECT_GT(testing_support::Dice(all, metacarpals.truth, 1), 0.97);
}

}  // namespace
}  // namespace kvx
