// What is written comes back through our own reader and passes the validator of dicom3tools.
#include "pipeline/io/dicom/segmentation_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_element.h"
#include "tests/support/fixtures.h"
#include "tests/support/unzipped.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;
using testing::Not;

const std::map<int, std::string> kNames{{1, "femur"}, {4, "tibia"}, {9, "fibula"}};

// A femur in the first planes, a tibia in all rows of the last column, no fibula; 7 is nobody's.
LabelMap Bones(const Grid& grid) {
  LabelMap labels(grid);
  for (int k = 0; k < grid.size.z(); ++k) {
    if (k < 4) labels(3, 2 + k, k) = 1;
    for (int j = 0; j < grid.size.y(); ++j) labels(grid.size.x() - 1, j, k) = 4;
    labels(0, 0, k) = 7;
  }
  return labels;
}

DicomSeries Series() {
  return {"MR", "sub_0123456789", Sha256("a model"), Sha256("a world"), "posed volume", "of a test"};
}

class SegmentationWriter : public testing::Test {
 protected:
  std::filesystem::path Write(const char* name, const LabelMap& labels,
                              const DicomSeries& series = Series()) {
    const std::filesystem::path file = folder_.path() / name;
    WriteDicomSegmentation(file, labels, kNames, series, ImagesOf(Volume(labels.grid), {}, series));
    return file;
  }

  const ScratchFolder folder_;
};

TEST_F(SegmentationWriter, BonesComeBackNumberedInTheirOrder) {
  for (const double handed : {1.0, -1.0}) {
    Grid grid = ObliqueGrid();
    grid.direction.col(2) *= handed;
    const LabelMap written = Bones(grid), read = ReadLabels(Write("bones.dcm", written));
    ASSERT_EQ(read.values.size(), written.values.size());
    for (size_t v = 0; v < read.values.size(); ++v) {
      const PointVox p = grid.ToVox(read.grid.ToMm(PointVox{read.grid.Ijk(v).cast<double>()}));
      const Eigen::Vector3i at = p.ijk.array().round().cast<int>();
      ASSERT_LT((p.ijk - at.cast<double>()).norm(), 1e-5) << v;
      const int label = written(at.x(), at.y(), at.z());
      ASSERT_EQ(read.values[v], label == 1 ? 1 : label == 4 ? 2 : 0) << v;
    }
  }
}

TEST_F(SegmentationWriter, TheValidatorOfOthersFindsNoError) {
  const auto said = folder_.path() / "said";
  const std::string command =
      "dciodvfy " + Write("bones.dcm", Bones(ObliqueGrid())).string() + " > " + said.string() + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(Content(said), Not(HasSubstr("Error")));
  EXPECT_THAT(Content(said), HasSubstr("Segmentation"));  // it knew what it read
}

TEST_F(SegmentationWriter, ItIsOfTheImagesOfTheSeries) {
  const LabelMap labels = Bones(ObliqueGrid());
  const DicomImages images = ImagesOf(Volume(labels.grid), {}, Series());
  const std::string bytes = Content(Write("bones.dcm", labels));
  WriteDicomZip(folder_.path() / "series.zip", Volume(labels.grid), {}, Series());
  const auto series = Unzipped(folder_.path() / "series.zip");
  ASSERT_EQ(images.images.size(), 11u);
  EXPECT_EQ(ElementOf(series / "image00003.dcm", 0x0008, 0x0018), images.images[2]);
  EXPECT_EQ(ElementOf(series / "image00003.dcm", 0x0020, 0x000e), images.series);
  EXPECT_THAT(bytes, HasSubstr(images.series));
  for (const std::string& image : images.images) EXPECT_THAT(bytes, HasSubstr(image));
}

TEST_F(SegmentationWriter, TheSameBonesGiveTheSameBytesAndOthersOtherNames) {
  const LabelMap labels = Bones(ObliqueGrid());
  LabelMap other = labels;
  other(5, 5, 5) = 1;
  const auto first = Write("a.dcm", labels), again = Write("b.dcm", labels), another = Write("c.dcm", other);
  EXPECT_EQ(Content(again), Content(first));
  EXPECT_NE(ElementOf(another, 0x0008, 0x0018), ElementOf(first, 0x0008, 0x0018));
  EXPECT_EQ(ElementOf(first, 0x0010, 0x0010), "") << "the patient's name";
}

TEST_F(SegmentationWriter, WithoutBonesThereIsNone) {
  const LabelMap labels(ObliqueGrid());
  EXPECT_THROW(WriteDicomSegmentation(folder_.path() / "a.dcm", labels, {}, Series(), {}), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace kvx
