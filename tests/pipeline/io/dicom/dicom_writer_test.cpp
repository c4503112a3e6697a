// What is written comes back through our own reader and passes the validator of dicom3tools.
#include "pipeline/io/dicom/dicom_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>

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

DicomSeries SeriesOf(const std::string& modality) {
  return {modality, "sub_0123456789", Sha256("a model"), Sha256("a world"), "posed volume", "of a test"};
}

Volume Counted(const Grid& grid, float low, float step) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = low + step * float(v % 997);
  return out;
}

// With the greys of the volume itself.
Scan WrittenAndRead(const std::filesystem::path& folder, const Volume& volume, ScalarType type,
                    const std::string& modality) {
  WriteDicomZip(folder / "series.zip", volume, DicomGreysOf({volume, type}), SeriesOf(modality));
  return ReadScan(Unzipped(folder / "series.zip"));
}

// A reader may count the planes the other way; the world does not change.
void ExpectSameWorld(const Volume& read, const Volume& written, float tolerance) {
  ASSERT_EQ(read.values.size(), written.values.size());
  for (size_t v = 0; v < read.values.size(); ++v) {
    const PointVox p = written.grid.ToVox(read.grid.ToMm(PointVox{read.grid.Ijk(v).cast<double>()}));
    const Eigen::Vector3i at = p.ijk.array().round().cast<int>();
    ASSERT_LT((p.ijk - at.cast<double>()).norm(), 1e-5) << v;
    ASSERT_NEAR(read.values[v], written(at.x(), at.y(), at.z()), tolerance) << v;
  }
}

class DicomModalities : public testing::TestWithParam<const char*> {};

TEST_P(DicomModalities, WholeNumbersAndGeometryComeBack) {
  const ScratchFolder folder;
  const Volume written = Counted(ObliqueGrid(), -300, 1);
  const Scan read = WrittenAndRead(folder.path(), written, ScalarType::kInt16, GetParam());
  EXPECT_EQ(read.modality, std::string(GetParam()));
  ExpectSameWorld(read.volume, written, 0);
}

TEST_P(DicomModalities, FractionsComeBackToTheStatedStep) {
  const ScratchFolder folder;
  const Volume written = Counted(ObliqueGrid(), 0, 0.001F);  // up to 0.996: steps of 5e-5
  const Scan read = WrittenAndRead(folder.path(), written, ScalarType::kFloat32, GetParam());
  ExpectSameWorld(read.volume, written, 2.6e-5F);
}

TEST_P(DicomModalities, TheValidatorOfOthersFindsNoError) {
  const ScratchFolder folder;
  for (const float step : {1.0F, 0.001F}) {
    const Volume volume = Counted(ObliqueGrid(), 0, step);
    WriteDicomZip(folder.path() / "series.zip", volume, DicomGreysOf({volume, ScalarType::kFloat32}),
                  SeriesOf(GetParam()));
    const auto image = Unzipped(folder.path() / "series.zip") / "image00003.dcm";
    const auto said = folder.path() / "said";
    const std::string command = "dciodvfy " + image.string() + " > " + said.string() + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_THAT(Content(said), Not(HasSubstr("Error")));
    EXPECT_THAT(Content(said), HasSubstr("Image"));  // it knew what it read
  }
}

INSTANTIATE_TEST_SUITE_P(All, DicomModalities, testing::Values("MR", "CT", ""),
                         [](const auto& modality) { return *modality.param ? modality.param : "Unknown"; });

TEST(DicomWriter, StepsAreWholeWhereTheRangeAllows) {
  const auto step = [](float least, float most, ScalarType type) {
    Volume volume(ObliqueGrid(), least);
    volume.values.back() = most;
    return DicomGreysOf({volume, type}).step;
  };
  EXPECT_EQ(step(0, 255, ScalarType::kUint8), 1);
  EXPECT_EQ(step(-1024, 3071, ScalarType::kInt16), 1);
  EXPECT_EQ(step(0, 65535, ScalarType::kUint16), 2) << "the least step that brings it into 15 bits";
  EXPECT_EQ(step(0, 1200, ScalarType::kFloat32), 1);
  EXPECT_EQ(step(-500, 500, ScalarType::kFloat64), 1);
  EXPECT_EQ(step(0, 40000, ScalarType::kFloat32), 2);
  EXPECT_DOUBLE_EQ(step(0, 328, ScalarType::kFloat32), 0.02);
  EXPECT_DOUBLE_EQ(step(0, 255, ScalarType::kFloat32), 0.01);
  EXPECT_EQ(step(0, 0, ScalarType::kFloat32), 1);
}

// Two poses of a model, of which one shows no bright tissue: the same stored value is the same grey.
TEST(DicomWriter, SeriesWithTheSameGreysAreShownAlike) {
  const ScratchFolder folder;
  const Volume of_template = Counted(ObliqueGrid(), 0, 0.25F);  // up to 249: steps of 0.01
  const DicomGreys greys = DicomGreysOf({of_template, ScalarType::kFloat32});
  for (const char* modality : {"MR", "CT", ""}) {
    std::vector<std::string> said;
    for (const float part : {1.0F, 0.25F}) {
      Volume pose = of_template;
      for (float& value : pose.values) value *= part;
      const std::string name = modality + std::to_string(int(100 * part));
      WriteDicomZip(folder.path() / (name + ".zip"), pose, greys, SeriesOf(modality));
      const auto series = Unzipped(folder.path() / (name + ".zip"));
      ExpectSameWorld(ReadScan(series).volume, pose, 0.0051F);
      for (const uint16_t element : {0x1050, 0x1051, 0x1052, 0x1053})  // window, intercept, slope
        said.push_back(ElementOf(series / "image00002.dcm", 0x0028, element));
    }
    ASSERT_EQ(said.size(), 8u);
    EXPECT_EQ(said[3], "0.01") << modality;
    EXPECT_TRUE(std::equal(said.begin(), said.begin() + 4, said.begin() + 4)) << modality;
  }
}

TEST(DicomWriter, MrInWholeStepsIsAsTheStandardHasIt) {
  const ScratchFolder folder;
  WriteDicomZip(folder.path() / "a.zip", Counted(ObliqueGrid(), 0, 1), {}, SeriesOf("MR"));
  EXPECT_EQ(ElementOf(Unzipped(folder.path() / "a.zip") / "image00001.dcm", 0x0028, 0x1053), "");
}

TEST(DicomWriter, WhoItIsOfIsMadeAnewAndTheFrameIsTheWorlds) {
  const ScratchFolder folder;
  const auto image_of = [&](const std::string& name, const std::string& model, const std::string& world,
                            const std::string& patient = "sub_0123456789") {
    const DicomSeries series{"MR", patient, Sha256(model), Sha256(world), "posed volume"};
    WriteDicomZip(folder.path() / (name + ".zip"), Counted(ObliqueGrid(), 0, 1), {}, series);
    return Unzipped(folder.path() / (name + ".zip")) / "image00001.dcm";
  };
  const auto first = image_of("a", "model", "template"), other_model = image_of("b", "model b", "template"),
             other_world = image_of("c", "model", "scan");
  constexpr std::pair<uint16_t, uint16_t> kStudy{0x0020, 0x000d}, kFrame{0x0020, 0x0052},
      kImage{0x0008, 0x0018};
  const auto uid = [](const std::filesystem::path& image, std::pair<uint16_t, uint16_t> tag) {
    return ElementOf(image, tag.first, tag.second);
  };
  EXPECT_TRUE(uid(first, kFrame).starts_with("2.25.")) << "no UID of a scan's own";
  EXPECT_EQ(uid(other_model, kFrame), uid(first, kFrame));
  EXPECT_NE(uid(other_model, kStudy), uid(first, kStudy));
  EXPECT_EQ(uid(other_world, kStudy), uid(first, kStudy));
  EXPECT_NE(uid(other_world, kFrame), uid(first, kFrame));
  EXPECT_NE(uid(other_world, kImage), uid(first, kImage)) << "another image, with its own UID";
  const auto other_patient = image_of("d", "model", "template", "sub_another");
  EXPECT_NE(uid(other_patient, kStudy), uid(first, kStudy));
  EXPECT_NE(uid(other_patient, kFrame), uid(first, kFrame));
  EXPECT_EQ(ElementOf(first, 0x0012, 0x0062), "YES");
  EXPECT_EQ(ElementOf(first, 0x0010, 0x0010), "");
}

TEST(DicomWriter, WhatASeriesSaysOfItselfTellsItFromOthers) {
  const ScratchFolder folder;
  const auto image_of = [&](const std::string& name, const std::string& description,
                            const std::string& comment) {
    DicomSeries series = SeriesOf("MR");
    series.description = description, series.comment = comment;
    WriteDicomZip(folder.path() / (name + ".zip"), Counted(ObliqueGrid(), 0, 1), {}, series);
    return Unzipped(folder.path() / (name + ".zip")) / "image00001.dcm";
  };
  const auto first = image_of("a", "flexion 20", "for research"),
             other_description = image_of("b", "flexion 60", "for research"),
             other_comment = image_of("c", "flexion 20", "");
  EXPECT_EQ(ElementOf(first, 0x0008, 0x103e), "flexion 20");
  EXPECT_EQ(ElementOf(first, 0x0020, 0x4000), "for research");
  EXPECT_EQ(ElementOf(other_comment, 0x0020, 0x4000), "");
  constexpr std::pair<uint16_t, uint16_t> kSeries{0x0020, 0x000e}, kNumber{0x0020, 0x0011},
      kImage{0x0008, 0x0018};
  for (const auto& [group, element] : {kSeries, kNumber, kImage}) {
    EXPECT_NE(ElementOf(other_description, group, element), ElementOf(first, group, element));
    EXPECT_NE(ElementOf(other_comment, group, element), ElementOf(first, group, element));
  }
}

TEST(DicomWriter, HalvesAreRoundedAsInTheOtherFormats) {
  const ScratchFolder folder;
  const Volume halves = Counted(ObliqueGrid(), -40.5F, 1);
  WriteVolume(folder.path() / "halves.nrrd", halves, ScalarType::kInt16);
  const Volume other = ReadScan(folder.path() / "halves.nrrd").volume;
  ExpectSameWorld(WrittenAndRead(folder.path(), halves, ScalarType::kInt16, "MR").volume, other, 0);
}

TEST(DicomWriter, LeftHandedAxesKeepTheirPlaceInTheWorld) {
  const ScratchFolder folder;
  Grid grid = ObliqueGrid();
  grid.direction.col(2) *= -1;
  const Volume written = Counted(grid, 0, 1);
  ExpectSameWorld(WrittenAndRead(folder.path(), written, ScalarType::kInt16, "MR").volume, written, 0);
}

TEST(DicomWriter, TheSameVolumeGivesTheSameBytesAndAnotherOtherImages) {
  const ScratchFolder folder;
  const auto bytes = [&](float low, const char* name) {
    WriteDicomZip(folder.path() / name, Counted(ObliqueGrid(), low, 1), {}, SeriesOf("MR"));
    return Content(folder.path() / name);
  };
  const std::string first = bytes(0, "a.zip");
  EXPECT_EQ(bytes(0, "b.zip"), first);
  EXPECT_NE(bytes(1, "c.zip"), first);
}

TEST(DicomWriter, WhatIsNotANumberIsRefusedAndNothingIsLeft) {
  const ScratchFolder folder;
  Volume volume = Counted(ObliqueGrid(), 0, 1);
  volume.values[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(WriteDicomZip(folder.path() / "a.zip", volume, {}, SeriesOf("MR")), InputError);
  EXPECT_THROW(DicomGreysOf({volume, ScalarType::kFloat32}), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace kvx
