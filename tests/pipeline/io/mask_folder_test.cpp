// A folder with one mask a bone reads as the label map that it was taken from.
#include "pipeline/io/mask_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_segmentation.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

using testing::ElementsAre;
using testing::HasSubstr;

class MaskFolder : public testing::Test {
 protected:
  // Four times the same row: what has one slice is no volume.
  static LabelMap Rows(const std::vector<uint16_t>& row) {
    Grid grid;
    grid.size = {int(row.size()), 2, 2};
    LabelMap mask(grid);
    for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = row[v % row.size()];
    return mask;
  }
  void Write(const std::string& file, const std::vector<uint16_t>& values) const {
    WriteLabels(folder_.path() / file, Rows(values));
  }
  std::vector<uint16_t> Read(const std::vector<StudyBone>& bones) const {
    const LabelMap labels = ReadMasks(folder_.path(), bones).labels;
    return {labels.values.begin(), labels.values.begin() + labels.grid.size.x()};
  }
  std::string Complaint(const std::vector<StudyBone>& bones) const {
    try {
      Read(bones);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no complaint";
  }
  ScratchFolder folder_;
};

TEST_F(MaskFolder, EachMaskIsTheLabelOfTheBoneThatItIsNamedAfter) {
  Write("femur.nii.gz", {1, 1, 0, 0, 0});
  Write("tibia.nrrd", {0, 0, 0, 255, 0});   // as others count
  Write("muscle.nii.gz", {0, 1, 1, 1, 1});  // no bone
  EXPECT_THAT(Read({{7, "tibia", "femur"}, {2, "femur", ""}}), ElementsAre(2, 2, 0, 7, 0));
}

TEST_F(MaskFolder, TheFirstOfTwoBonesHasTheVoxelsOfBoth) {
  Write("femur.nii", {1, 1, 0});
  Write("tibia.nii", {0, 1, 1});
  EXPECT_THAT(Read({{1, "femur", ""}, {2, "tibia", "femur"}}), ElementsAre(1, 1, 2));
  EXPECT_THAT(Read({{2, "tibia", "femur"}, {1, "femur", ""}}), ElementsAre(1, 2, 2));
  using Shared = std::map<int, size_t>;
  EXPECT_EQ(ReadMasks(folder_.path(), {{1, "femur", ""}, {2, "tibia", "femur"}}).shared_voxels,
            (Shared{{2, 4}}));
  EXPECT_EQ(ReadMasks(folder_.path(), {{1, "femur", ""}}).shared_voxels, Shared());
}

// Exported again in another format beside the old one.
TEST_F(MaskFolder, TwoMasksOfABoneAreRefused) {
  Write("femur.nii.gz", {1, 0, 0});
  Write("femur.nrrd", {0, 1, 0});
  Write("tibia.nrrd", {0, 0, 1});
  EXPECT_THAT(Complaint({{1, "femur", ""}, {2, "tibia", "femur"}}),
              HasSubstr("two masks of bone 'femur', femur.nii.gz and femur.nrrd"));
  EXPECT_THAT(Read({{2, "tibia", ""}}), ElementsAre(0, 0, 2));
}

TEST_F(MaskFolder, AnEmptyMaskIsABoneWithoutVoxels) {
  Write("femur.mha", {1, 0, 0});
  Write("tibia.mha", {0, 0, 0});
  EXPECT_THAT(Read({{1, "femur", ""}, {2, "tibia", "femur"}}), ElementsAre(1, 0, 0));
}

// Archives leave out frames that are empty.
TEST_F(MaskFolder, SegmentationsMayLackSlicesWithoutTheirBone) {
  WriteSegmentation(folder_.path() / "femur.dcm", 1, 1);
  WriteSegmentation(folder_.path() / "tibia.dcm", 1, -1);
  const LayeredLabels read = ReadMasks(folder_.path(), {{1, "femur", ""}, {7, "tibia", "femur"}});
  ASSERT_EQ(read.labels.grid.size, Eigen::Vector3i(8, 8, 5));
  EXPECT_EQ(read.labels.grid.origin.lps, Eigen::Vector3d(0, 0, -1));
  std::vector<int> along;
  for (int k = 0; k < 5; ++k) along.push_back(read.labels(0, 0, k));
  EXPECT_THAT(along, ElementsAre(7, 7, 1, 1, 1)) << "the femur has what they share";
  EXPECT_EQ(read.shared_voxels, (std::map<int, size_t>{{7, 5}}));
}

TEST_F(MaskFolder, MasksBetweenEachOthersVoxelsAreRefused) {
  LabelMap mask = Rows({1, 1, 0});
  WriteLabels(folder_.path() / "femur.nrrd", mask);
  const std::vector<StudyBone> bones{{1, "femur", ""}, {2, "tibia", "femur"}};
  const auto complaint_of = [&](const Grid& grid) {
    LabelMap tibia(grid);
    tibia.values = mask.values;
    WriteLabels(folder_.path() / "tibia.nrrd", tibia);
    return Complaint(bones);
  };
  Grid grid = mask.grid;
  EXPECT_EQ(complaint_of(grid), "no complaint");
  grid.origin.lps.y() = 3.1;
  EXPECT_EQ(complaint_of(grid), "no complaint");
  grid.origin.lps.y() = 3.5;
  EXPECT_THAT(complaint_of(grid), HasSubstr("different grids"));
  grid = mask.grid, grid.spacing_mm.x() = 1.2;
  EXPECT_THAT(complaint_of(grid), HasSubstr("different grids"));
  grid = mask.grid, grid.direction.col(2) *= -1;
  EXPECT_THAT(complaint_of(grid), HasSubstr("different grids"));
}

TEST_F(MaskFolder, AFolderWithASegmentationOfNoBonesNameIsALabelMap) {
  WriteSegmentation(folder_.path() / "1.2.3.dcm", 1);
  const std::vector<StudyBone> bones{{1, "femur", ""}};
  EXPECT_FALSE(HoldsMasks(folder_.path(), bones));
  EXPECT_EQ(ReadLabelsOrMasks(folder_.path(), bones).labels.values, ReadLabels(folder_.path()).values);
  Write("femur.nii.gz", {1, 1, 0});
  EXPECT_TRUE(HoldsMasks(folder_.path(), bones));
  EXPECT_EQ(ReadLabelsOrMasks(folder_.path(), bones).labels.grid.size, Eigen::Vector3i(3, 2, 2));
}

TEST_F(MaskFolder, WhatIsWrongIsSaidOfTheBone) {
  Write("femur.nii.gz", {1, 1, 0});
  LabelMap between = Rows({0, 1});
  between.grid.origin.lps.x() = 0.5;
  WriteLabels(folder_.path() / "tibia.nii.gz", between);
  Write("fibula.nii.gz", {0, 1, 2});
  EXPECT_THAT(Complaint({{1, "patella", ""}}), HasSubstr("'patella': is not in the folder"));
  EXPECT_THAT(Complaint({{1, "femur", ""}, {2, "tibia", "femur"}}), HasSubstr("different grids"));
  EXPECT_THAT(Complaint({{1, "fibula", ""}}), HasSubstr("several values inside"));
}

}  // namespace
}  // namespace kvx
