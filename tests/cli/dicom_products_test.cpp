// What the command line makes of a model as DICOM: posed series, and segmentations of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_element.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_model_test.h"
#include "tests/support/unzipped.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

class DicomProducts : public HingeModelTest {};

TEST_F(DicomProducts, ADicomSeriesIsThePosedVolume) {
  ExpectDone({"pose", At("model"), "--scan", "pose01", "--modality", "MR", "--out", At("series.zip")});
  ExpectDone({"pose", At("model"), "--scan", "pose01", "--out", At("posed.nrrd")});
  const auto images = Unzipped(At("series.zip"));
  const Scan series = ReadScan(images), posed = ReadScan(At("posed.nrrd"));
  EXPECT_EQ(series.modality, "MR");
  ASSERT_TRUE(series.volume.grid == posed.volume.grid);
  EXPECT_EQ(series.volume.values, posed.volume.values);
  EXPECT_EQ(Run({"pose", At("model"), "--scan", "pose01", "--label", "--out", At("x.zip")}).code, 3);
  EXPECT_EQ(Run({"pose", At("model"), "--scan", "pose01", "--out", At("x.dcm")}).code, 3);
  EXPECT_EQ(Run({"pose", At("model"), "--scan", "pose01", "--modality", "MR", "--out", At("x.nrrd")}).code,
            2);
}

TEST_F(DicomProducts, PosedBonesAreADicomSegmentationOfTheSeries) {
  ExpectDone({"pose", At("model"), "--scan", "pose01", "--modality", "MR", "--out", At("series.zip")});
  ExpectDone(
      {"pose", At("model"), "--scan", "pose01", "--modality", "MR", "--label", "--out", At("bones.dcm")});
  ExpectDone({"pose", At("model"), "--scan", "pose01", "--label", "--out", At("bones.nrrd")});
  const auto images = Unzipped(At("series.zip"));
  const auto image = images / "image00001.dcm";
  const std::string segmentation = Content(At("bones.dcm"));
  for (const uint16_t element : {0x000d, 0x000e, 0x0052})  // study, series and frame of reference
    EXPECT_THAT(segmentation, HasSubstr(ElementOf(image, 0x0020, element)));
  EXPECT_THAT(segmentation, HasSubstr("lower")) << "a bone's name";
  const LabelMap read = ReadLabels(At("bones.dcm")), posed = ReadLabels(At("bones.nrrd"));
  const auto count = [](const LabelMap& labels, int label) {
    return std::count(labels.values.begin(), labels.values.end(), label);
  };
  for (const int label : {1, 2}) EXPECT_EQ(count(read, label), count(posed, label)) << label;
}

// By angles the template's frame of reference, as in a scan that scan's; one grey scale throughout.
TEST_F(DicomProducts, DicomSeriesOfAModelShareWhatTheyHaveInCommon) {
  const auto image_of = [](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"pose", At("model")});
    arguments.insert(arguments.end(), {"--modality", "MR", "--out", At(name + ".zip")});
    ExpectDone(arguments);
    return Unzipped(At(name + ".zip")) / "image00001.dcm";
  };
  const auto still = image_of("still", {"--joint", "lower.flexion=0"}),
             bent = image_of("bent", {"--joint", "lower.flexion=20", "--level", "1"}),
             as_in_scan = image_of("as_in_scan", {"--scan", "pose01"});
  const auto frame = [](const auto& image) { return ElementOf(image, 0x0020, 0x0052); };
  const auto width = [](const auto& image) { return ElementOf(image, 0x0028, 0x1051); };
  EXPECT_NE(frame(still), "");
  EXPECT_EQ(frame(bent), frame(still));
  EXPECT_NE(frame(as_in_scan), frame(still));
  EXPECT_NE(width(still), "");
  EXPECT_EQ(width(bent), width(still));
  EXPECT_EQ(width(as_in_scan), width(still));
}

}  // namespace
}  // namespace kvx
