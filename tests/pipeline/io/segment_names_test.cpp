// What files call their segments, by the label that they read as.
#include "pipeline/io/segment_names.h"

#include <gtest/gtest.h>

#include <fstream>

#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_segmentation.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using Names = std::map<int, std::string>;

TEST(SegmentNames, AreThoseOfADicomSegmentation) {
  const ScratchFolder folder;
  WriteSegmentation(folder.path() / "bones.dcm", {.segments = 2});
  EXPECT_EQ(ReadSegmentNames(folder.path() / "bones.dcm"), (Names{{1, "Bone 1"}, {2, "Bone 2"}}));
  EXPECT_EQ(ReadSegmentNames(folder.path()), (Names{{1, "Bone 1"}, {2, "Bone 2"}}));
}

TEST(SegmentNames, OfSlicersFilesGoByTheirValues) {
  const ScratchFolder folder;
  const auto path = folder.path() / "bones.seg.nrrd";
  std::ofstream(path, std::ios::binary)
      << "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
         "space: left-posterior-superior\nspace origin: (0,0,0)\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
         "Segment0_ID:=a\nSegment0_LabelValue:=5\nSegment0_Layer:=0\nSegment0_Name:=Patella\n\n"
      << std::string("\0\5\0\5\0\5\0\5", 8);
  EXPECT_EQ(ReadSegmentNames(path), (Names{{5, "Patella"}}));
  EXPECT_EQ(ReadLabels(path).values[1], 5);
}

TEST(SegmentNames, AreNoneOfPlainLabelMaps) {
  const ScratchFolder folder;
  LabelMap labels(ObliqueGrid({3, 3, 3}));
  for (const char* file : {"a.nii.gz", "a.nrrd", "a.mha"}) {
    WriteLabels(folder.path() / file, labels);
    EXPECT_EQ(ReadSegmentNames(folder.path() / file), Names()) << file;
  }
}

}  // namespace
}  // namespace kvx
