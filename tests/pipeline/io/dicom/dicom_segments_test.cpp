// DICOM segmentations as label maps: files of few voxels, written element by element.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_segmentation.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

class DicomSegments : public testing::Test {
 protected:
  LayeredLabels Read(const SegmentationFile& of) {
    WriteSegmentation(file_, of);
    return ReadLayeredLabels(file_);
  }
  std::string ComplaintOf(const SegmentationFile& of) {
    WriteSegmentation(file_, of);
    return RefusalOf<InputError>([&] { ReadLabels(file_); }, "none");
  }

  const ScratchFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "seg.dcm";
};

// A frame of one bit a voxel in which row `row` is inside.
std::string Row(int row) {
  std::string bits(8, '\0');
  bits[size_t(row)] = '\xff';
  return bits;
}

TEST_F(DicomSegments, ASegmentationIsALabelMapAndNoScan) {
  const LabelMap labels = Read({.segments = 1}).labels;
  ASSERT_EQ(labels.grid.size, Eigen::Vector3i(8, 8, 3));
  EXPECT_EQ(ReadLabelsGrid(file_), labels.grid);
  EXPECT_EQ(std::count(labels.values.begin(), labels.values.end(), 1), 3 * 5);
  EXPECT_EQ(std::count(labels.values.begin(), labels.values.end(), 0), 3 * 59);
  EXPECT_EQ(labels(0, 0, 1), 1);
  for (const int segments : {1, 4}) {
    WriteSegmentation(file_, {.segments = segments});
    EXPECT_THAT(RefusalOf<InputError>([&] { ReadScan(file_); }, "none"),
                HasSubstr("a segmentation (SEG) and no scan"));
    EXPECT_THROW(ReadVolumeInfo(file_), InputError);
  }
}

// Each in planes of its own, and frames in any order.
TEST_F(DicomSegments, LabelsAreTheNumbersOfSegments) {
  const LabelMap labels =
      Read({.segments = 3,
            .frames = {{3, 6, Row(3)}, {1, 2, Row(1)}, {1, 3, Row(1)}, {3, 5, Row(3)}, {2, 3, Row(2)}}})
          .labels;
  ASSERT_EQ(labels.grid.size, Eigen::Vector3i(8, 8, 5));
  EXPECT_EQ(ReadLabelsGrid(file_), labels.grid);
  EXPECT_EQ(labels.grid.origin.lps.z(), 2);
  const int bone_of[8][5] = {{}, {1, 1, 0, 0, 0}, {0, 2, 0, 0, 0}, {0, 0, 0, 3, 3}};
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) EXPECT_EQ(labels(i, j, k), bone_of[j][k]) << i << ' ' << j << ' ' << k;
}

TEST_F(DicomSegments, WhatSegmentsShareIsTheFirstOnes) {
  for (const bool first_comes_first : {true, false}) {
    SegmentationFile of{.segments = 2,
                        .frames = {{1, 0, Row(4)}, {1, 1, Row(4)}, {2, 0, Row(4)}, {2, 1, Row(5)}}};
    if (!first_comes_first) std::reverse(of.frames.begin(), of.frames.end());
    const LayeredLabels read = Read(of);
    EXPECT_EQ(read.labels(0, 4, 0), 1);
    EXPECT_EQ(read.labels(0, 5, 1), 2);
    EXPECT_EQ(read.shared_voxels, (std::map<int, size_t>{{2, 8}}));
  }
}

// A frame of a whole body ends within a byte where its voxels are no multiple of eight.
TEST_F(DicomSegments, NumbersOfSegmentsMayBeTheVoxelsThemselves) {
  std::string bytes(64, '\0'), words(128, '\0');
  bytes[0] = 7, bytes[63] = 2;
  words[0] = 7, words[126] = 2, words[2] = 1, words[3] = 1;  // 257
  for (const char* shown : {"MONOCHROME2", "PALETTE COLOR"}) {
    for (const bool packed : {false, true}) {
      const LabelMap labels = Read({.frames = {{0, 0, bytes}, {0, 1, bytes}},
                                    .numbered_bits = 8,
                                    .shown = shown,
                                    .packed = packed})
                                  .labels;
      EXPECT_EQ(labels(0, 0, 0), 7) << shown << packed;
      EXPECT_EQ(labels(7, 7, 1), 2) << shown << packed;
      EXPECT_EQ(labels(1, 0, 0), 0) << shown << packed;
    }
  }
  const LabelMap labels = Read({.frames = {{0, 0, words}, {0, 1, words}}, .numbered_bits = 16}).labels;
  EXPECT_EQ(labels(0, 0, 0), 7);
  EXPECT_EQ(labels(1, 0, 1), 257);
  EXPECT_EQ(labels(7, 7, 1), 2);
}

// Programs leave out the planes in which a segment has nothing.
TEST_F(DicomSegments, PlanesThatASegmentationLeavesOutAreEmpty) {
  const LabelMap labels = Read({.places = {4, 5, 8}}).labels;
  ASSERT_EQ(labels.grid.size, Eigen::Vector3i(8, 8, 5));
  EXPECT_EQ(ReadLabelsGrid(file_), labels.grid);
  EXPECT_NEAR(labels.grid.spacing_mm.z(), 1, 1e-9);
  for (int plane = 0; plane < 5; ++plane) EXPECT_EQ(labels(0, 0, plane), plane < 2 || plane == 4) << plane;
  EXPECT_EQ(Read({.places = {4, 8}}).labels.grid.spacing_mm.z(), 4);
  EXPECT_EQ(Read({.places = {4, 8}, .between = "2"}).labels.grid.size.z(), 3) << "its own word";
  EXPECT_THAT(ComplaintOf({.places = {0, 4, 10}}), HasSubstr("unevenly spaced"));
  EXPECT_THAT(ComplaintOf({.places = {4, 8}, .between = "1e-30"}), HasSubstr("unevenly spaced"));
  EXPECT_THAT(ComplaintOf({.segments = 3, .places = {4}}), HasSubstr("a single slice"));
}

TEST_F(DicomSegments, AProbabilityIsInsideFromAHalfOn) {
  for (const uint16_t certain : {1, 100, 255}) {
    const LabelMap labels = Read({.segments = 1, .certain = certain}).labels;
    EXPECT_EQ(labels(0, 0, 1), 1) << certain;
    EXPECT_EQ(labels(1, 0, 1), 1) << certain;
    EXPECT_EQ(labels(2, 0, 1), 0) << certain;
    EXPECT_EQ(labels(0, 1, 1), 0) << certain;
  }
}

TEST_F(DicomSegments, WhatDoesNotTellItsSegmentsIsRefused) {
  EXPECT_EQ(Read({.segments = 1, .tells_segments = false}).labels(0, 0, 1), 1) << "there is only one";
  EXPECT_THAT(ComplaintOf({.segments = 2, .tells_segments = false}),
              HasSubstr("which of its segments a frame is of"));
  EXPECT_THAT(ComplaintOf({.frames = {{1, 0, Row(1)}, {1, 1, Row(1)}, {1, 1, Row(2)}}}),
              HasSubstr("a segment twice at the same place"));
}

TEST_F(DicomSegments, VoxelsThatAreNotThereAreMissed) {
  EXPECT_THAT(
      ComplaintOf({.frames = {{0, 0, std::string(64, 1)}, {0, 1, std::string(10, 1)}}, .numbered_bits = 8}),
      HasSubstr("damaged"));
  EXPECT_THAT(ComplaintOf({.frames = {{1, 0, Row(1)}, {1, 1, Row(1)}}, .packed = true}), HasSubstr("packed"));
}

TEST_F(DicomSegments, OfSeveralSegmentationsNoneIsGuessed) {
  WriteSegmentation(file_, {.segments = 2});
  WriteSegmentation(folder_.path() / "other.dcm", {.segments = 1});
  EXPECT_THAT(RefusalOf<InputError>([&] { ReadLabels(folder_.path()); }, "none"),
              HasSubstr("a segment twice at the same place"));
}

}  // namespace
}  // namespace kvx
