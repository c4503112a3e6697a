// What is written comes back through our own reader and passes the validator of dicom3tools.
#include "pipeline/io/dicom_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;
using testing::Not;

DicomSeries SeriesOf(const std::string& modality) {
  return {modality, "sub_0123456789", Sha256("a model"), "posed volume"};
}

Volume Counted(const Grid& grid, float low, float step) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = low + step * float(v % 997);
  return out;
}

// The images of the zip, in a folder of their own. Paths of ours without blanks: a shell is safe.
std::filesystem::path Unzipped(const std::filesystem::path& zip) {
  const auto folder = std::filesystem::path(zip).replace_extension();
  const std::string command = "/usr/bin/python3 -m zipfile -e " + zip.string() + " " + folder.string();
  EXPECT_EQ(std::system(command.c_str()), 0);
  return folder;
}

Scan WrittenAndRead(const std::filesystem::path& folder, const Volume& volume, ScalarType type,
                    const std::string& modality) {
  WriteDicomZip(folder / "series.zip", volume, type, SeriesOf(modality));
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
  Scan read = WrittenAndRead(folder.path(), written, ScalarType::kFloat32, GetParam());
  // GDCM, which reads for us, leaves MR's real world value map aside: the stored numbers come.
  if (read.modality == "MR")
    for (float& value : read.volume.values) value *= 5e-5F;
  ExpectSameWorld(read.volume, written, 2.6e-5F);
}

TEST_P(DicomModalities, TheValidatorOfOthersFindsNoError) {
  const ScratchFolder folder;
  for (const float step : {1.0F, 0.001F}) {
    WriteDicomZip(folder.path() / "series.zip", Counted(ObliqueGrid(), 0, step), ScalarType::kFloat32,
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
    WriteDicomZip(folder.path() / name, Counted(ObliqueGrid(), low, 1), ScalarType::kInt16, SeriesOf("MR"));
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
  EXPECT_THROW(WriteDicomZip(folder.path() / "a.zip", volume, ScalarType::kInt16, SeriesOf("MR")),
               InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace kvx
