// DICOM series against the NIfTI answers that another program gave, voxel by voxel at the same place in the
// patient.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_files.h"
#include "pipeline/io/dicom/dicom_segments.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_bytes.h"
#include "tests/support/dicom_segmentation.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

std::filesystem::path Set(const std::string& name) { return SharedData() / "dicom-d2n" / name; }

std::string Complaint(const std::filesystem::path& path) {
  return RefusalOf<InputError>([&] { ReadScan(path); }, "none");
}

// The two may order their voxels differently; the world does not.
void ExpectSameWorld(const Volume& ours, const Volume& answer, const std::string& name) {
  ASSERT_EQ(ours.values.size(), answer.values.size()) << name;
  for (size_t v = 0; v < ours.values.size(); v += 7) {
    const Eigen::Vector3d p =
        answer.grid.ToVox(ours.grid.ToMm(PointVox{ours.grid.Ijk(v).cast<double>()})).ijk;
    const Eigen::Vector3i nearest = p.array().round().cast<int>();
    ASSERT_LT((p - nearest.cast<double>()).norm(), 0.01) << name << " voxel " << v;
    ASSERT_TRUE(answer.grid.Contains(nearest)) << name;
    ASSERT_NEAR(ours.values[v], answer(nearest.x(), nearest.y(), nearest.z()), 1e-2)
        << name << " voxel " << v;
  }
}

TEST(DicomSeries, AgreeWithTheirNiftiAnswers) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  for (const char* name :
       {"ge/anatomical/001", "siemens/anatomical/001", "philips/anatomical/001", "hitachi/anatomical/001",
        "hyperfine/anatomical/001", "philips_enhanced/anatomical/001", "siemens_multiframe/anatomical/001",
        "generic/anatomical/001", "generic/anatomical/002_non_isotropic", "generic/compressed/001",
        "generic/compressed_j2k/001", "generic/compressed_jpeg/001", "generic/compressed_jpegls/001",
        "generic/compressed_rle/001"}) {
    const Scan ours = ReadScan(Set(name));
    EXPECT_EQ(ours.modality, "MR") << name;
    EXPECT_GT(ours.volume.grid.direction.determinant(), 0.99) << name;
    EXPECT_TRUE(ReadVolumeInfo(Set(name)).grid == ours.volume.grid) << name;
    ExpectSameWorld(ours.volume, ReadScan(Set(std::string(name) + "_ground_truth.nii.gz")).volume, name);
  }
}

TEST(DicomSeries, AnImageOfManyFramesNeedsNoFolder) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  for (const auto& [name, image] :
       {std::pair("philips_enhanced/anatomical/001", "IM-0001-0170-0001.dcm"),
        std::pair("siemens_multiframe/anatomical/001", "IM-0001-0001-0001.dcm")}) {
    const Scan alone = ReadScan(Set(name) / image), in_folder = ReadScan(Set(name));
    EXPECT_TRUE(alone.volume.grid == in_folder.volume.grid) << name;
    EXPECT_TRUE(alone.volume.values == in_folder.volume.values) << name;
    EXPECT_EQ(alone.modality, "MR") << name;
  }
}

// As exports of whole studies hold it: localisers, images that lie nowhere, other series.
TEST(DicomSeries, WhatLiesBesideTheOnlyVolumeDoesNotCount) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  const auto study = SharedData() / "dicom-odd/test_files/dicomdirtests/98892001";
  EXPECT_THAT(Complaint(study / "CT2N"), HasSubstr("turned against each other (a localiser?)"));
  EXPECT_TRUE(ReadScan(study).volume.values == ReadScan(study / "CT5N").volume.values);

  const ScratchFolder folder;
  const auto volume = Set("generic/anatomical/001");
  const auto copy = [&](const std::filesystem::path& from, const char* to) {
    std::filesystem::copy(from, folder.path() / to, std::filesystem::copy_options::recursive);
    std::filesystem::permissions(folder.path() / to, std::filesystem::perms::owner_all);
  };
  copy(volume, "volume");
  copy(Set("failing/sliceorientation/001"), "turned");
  copy(SharedData() / "dicom-odd/test_files/SC_rgb_jpeg.dcm", "screenshot.dcm");
  copy(SharedData() / "dicom-odd/test_files/MR_small.dcm", "single.dcm");
  EXPECT_TRUE(ReadScan(folder.path()).volume.values == ReadScan(volume).volume.values);
  EXPECT_TRUE(ReadVolumeInfo(folder.path()).grid == ReadScan(volume).volume.grid);
  copy(Set("ge/anatomical/001"), "other");
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("2 DICOM series that may be volumes"));
  std::filesystem::remove_all(folder.path() / "other");
  copy(Set("failing/sliceincrement/001"), "gap");
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("2 DICOM series that may be volumes"))
      << "a damaged series may be the one that is meant";
}

TEST(DicomSeries, WhatIsNoVolumeIsRefusedWithItsReason) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  EXPECT_THAT(Complaint(Set("failing/gantrytilting/001")), HasSubstr("gantry tilt"));
  EXPECT_THAT(Complaint(Set("failing/sliceorientation/001")), HasSubstr("turned against each other"));
  EXPECT_THAT(Complaint(Set("failing/sliceincrement/001")), HasSubstr("missing"));
  EXPECT_THAT(Complaint(Set("failing/notavolume/001")), HasSubstr("same place"));
  EXPECT_THAT(Complaint(SharedData() / "knee-mese-dicom/dicom"), HasSubstr("3 echoes"));
  EXPECT_THAT(Complaint(SharedData() / "dicom-odd/test_files/dicomdirtests/98892003/MR1"),
              HasSubstr("3 DICOM series, none of which is a volume"));
  EXPECT_THAT(Complaint(SharedData() / "dicom-odd/test_files/SC_rgb_jpeg.dcm"), HasSubstr("where they lie"));
  EXPECT_THAT(Complaint(SharedData() / "dicom-odd/test_files/MR_small.dcm"), HasSubstr("a single slice"));
  EXPECT_THAT(Complaint(SharedData() / "dicom-odd/test_files/rtstruct.dcm"), HasSubstr("no image"));
}

TEST(DicomSeries, ADamagedMissingOrForeignFileIsNoticed) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  const ScratchFolder folder;
  const auto fresh = [&] {
    std::filesystem::remove_all(folder.path() / "s");
    std::filesystem::copy(Set("generic/anatomical/001"), folder.path() / "s",
                          std::filesystem::copy_options::recursive);
    return folder.path() / "s";
  };
  const std::filesystem::path second = fresh() / "IM-0001-0002-0001.dcm";
  std::filesystem::remove(second);
  EXPECT_THAT(Complaint(folder.path() / "s"), HasSubstr("missing"));
  std::filesystem::permissions(fresh(), std::filesystem::perms::owner_all);
  std::filesystem::permissions(second, std::filesystem::perms::owner_all);
  std::filesystem::resize_file(second, std::filesystem::file_size(second) / 2);
  EXPECT_NE(Complaint(folder.path() / "s"), "none") << "voxels cut off";
  std::filesystem::resize_file(second, 300);
  EXPECT_NE(Complaint(folder.path() / "s"), "none") << "header cut off";
  std::filesystem::create_directories(folder.path() / "empty");
  EXPECT_THAT(Complaint(folder.path() / "empty"), HasSubstr("no DICOM images"));
}

// Names without an ending, as scanners give them.
TEST(DicomSeries, WhatIsNoSliceOfANamelessKindIsLeftOutOrNoticed) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 4; ++slice)
    WriteCtSlice(folder.path() / ("IM" + std::to_string(slice)), slice, "1");
  const Volume whole = ReadScan(folder.path()).volume;
  std::filesystem::copy(folder.path() / "IM1", folder.path() / "IM1 (copy)");
  std::ofstream(folder.path() / "README") << "four slices";
  EXPECT_TRUE(ReadScan(folder.path()).volume.values == whole.values);
  EXPECT_EQ(ReadVolumeInfo(folder.path()).grid.size.z(), 4);
  WriteCtSlice(folder.path() / "IM1 (copy)", {.slice = 1, .slope = "2"});
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("same place"));
  std::filesystem::remove(folder.path() / "IM1 (copy)");
  for (const uintmax_t bytes : {100, 0}) {
    std::filesystem::resize_file(folder.path() / "IM3", bytes);
    EXPECT_THAT(Complaint(folder.path()), HasSubstr("does not begin as DICOM files do")) << bytes;
  }
}

// git-annex and DataLad leave such links of what was not fetched.
TEST(DicomSeries, SlicesBehindLinksAreReadOrMissed) {
  const ScratchFolder folder;
  for (const char* place : {"series", "elsewhere"}) std::filesystem::create_directory(folder.path() / place);
  for (int slice = 0; slice < 4; ++slice) {
    const std::string name = "IM" + std::to_string(slice);
    WriteCtSlice(folder.path() / "elsewhere" / name, slice, "1");
    std::filesystem::create_symlink("../elsewhere/" + name, folder.path() / "series" / name);
  }
  EXPECT_EQ(ReadVolumeInfo(folder.path() / "series").grid.size.z(), 4);
  std::filesystem::remove(folder.path() / "elsewhere/IM3");
  EXPECT_THAT(Complaint(folder.path() / "series"), HasSubstr("links to images that are not there"));
}

TEST(DicomSeries, GreysThatStandInATableAreRefused) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 2; ++slice) {
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"),
                 {.slice = slice,
                  .more = DicomBytes().Sequence(0x00283000, {DicomBytes().Text(0x00283004, "LO", "HU")})});
  }
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("modality LUT"));
}

TEST(DicomSeries, ASlopeOfNothingIsRefused) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, slice == 1 ? "0.0" : "1");
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("rescale slope of a DICOM image is 0"));
}

TEST(DicomSeries, ParametricMapsOfFloatsAreNoScan) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice) {
    const std::string name = std::to_string(slice) + ".dcm";
    DicomBytes map = HeaderOf({.slice = slice, .modality = "MR", .series = "2.25.6"});
    map.Floats(0x7fe00008, std::string(16, '\0')).WriteTo(folder.path() / ("map" + name));
  }
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("parametric maps"));
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, "1");
  EXPECT_EQ(Complaint(folder.path()), "none") << "beside a scan they do not count";
}

TEST(DicomSeries, APixelSpacingIsPositive) {
  for (const char* spacing : {"-1\\1", "1\\0"}) {
    const ScratchFolder folder;
    for (int slice = 0; slice < 3; ++slice)
      WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), {.slice = slice, .spacing = spacing});
    EXPECT_THAT(Complaint(folder.path()), HasSubstr("pixel spacing that is not a positive number"));
  }
}

TEST(DicomSeries, ColoursAreNoScanAndDoNotCountBesideOne) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder.path() / "coloured");
  for (int slice = 0; slice < 3; ++slice) {
    const std::string name = std::to_string(slice) + ".dcm";
    WriteCtSlice(folder.path() / "coloured" / name,
                 {.slice = slice, .shown = "PALETTE COLOR", .is_signed = 0, .series = "2.25.5"});
  }
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("colours and are no scan"));
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, "1");
  EXPECT_EQ(Complaint(folder.path()), "none");
}

TEST(DicomSeries, OneSliceWithFractionsMakesTheVolumeOne) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, slice == 1 ? "0.5" : "1");
  const Scan scan = ReadScan(folder.path());
  EXPECT_EQ(scan.stored_as, ScalarType::kFloat32);
  EXPECT_EQ(scan.volume(0, 0, 0), 3);
  EXPECT_EQ(scan.volume(0, 0, 1), 1.5f);
  WriteCtSlice(folder.path() / "1.dcm", 1, "1");
  EXPECT_EQ(ReadScan(folder.path()).stored_as, ScalarType::kInt16);
}

// The decoder gives them in 64 bits, which posed volumes would be written in.
TEST(DicomSeries, FractionalSlopesNeedNoMoreThan32Bits) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, "0.5");
  EXPECT_EQ(ReadScan(folder.path()).stored_as, ScalarType::kFloat32);
  EXPECT_EQ(ReadVolumeInfo(folder.path()).stored_as, ScalarType::kFloat32);
}

// Shifts and steps each within what headers round to may add up: voxels of 1 mm and slices 1 mm apart, the
// n-th 0.04 n mm beside its place, or from the tenth on 0.04 mm more apart.
TEST(DicomSeries, SmallShiftsThatAddUpAreNoStraightVolume) {
  const ScratchFolder folder;
  const auto complaint = [&](int slices, double shift_mm, double longer_mm) {
    std::filesystem::remove_all(folder.path() / "s");
    std::filesystem::create_directory(folder.path() / "s");
    for (int n = 0; n < slices; ++n) {
      const double along_mm = n + longer_mm * std::max(0, n - 10);
      WriteCtSlice(
          folder.path() / "s" / (std::to_string(n) + ".dcm"),
          {.slice = n, .position = "0\\" + std::to_string(shift_mm * n) + "\\" + std::to_string(along_mm)});
    }
    return Complaint(folder.path() / "s");
  };
  EXPECT_EQ(complaint(7, 0.04, 0), "none") << "0.24 mm in all";
  EXPECT_THAT(complaint(8, 0.04, 0), HasSubstr("gantry tilt"));
  EXPECT_EQ(complaint(20, 0, 0.04), "none") << "0.19 mm from even steps at most";
  EXPECT_THAT(complaint(40, 0, 0.04), HasSubstr("unevenly spaced"));
}

// As exporters round positions: every other slice 0.03 mm off, of 0.5 mm.
TEST(DicomSeries, PositionsThatAreRoundedAreEvenWhereSlicesAreFarApartAgainstThat) {
  const ScratchFolder folder;
  const auto complaint = [&](double step_mm, double jitter_mm) {
    for (int n = 0; n < 12; ++n) {
      WriteCtSlice(
          folder.path() / (std::to_string(n) + ".dcm"),
          {.slice = n, .position = "0\\0\\" + std::to_string(step_mm * n + (n % 2 ? 1 : -1) * jitter_mm)});
    }
    return Complaint(folder.path());
  };
  EXPECT_EQ(complaint(0.5, 0.03), "none");
  EXPECT_NEAR(ReadVolumeInfo(folder.path()).grid.spacing_mm.z(), 0.5 + 0.06 / 11, 1e-6) << "the mean";
  EXPECT_EQ(complaint(1.25, 0.04), "none");
  EXPECT_EQ(complaint(7, 0.06), "none") << "2 % of a step";
  EXPECT_THAT(complaint(1.25, 0.06), HasSubstr("unevenly spaced"));
  EXPECT_THAT(complaint(0.3, 0.05), HasSubstr("missing or the gaps"));
}

// Of decimal strings PS3.5 allows a sign, and spaces at both ends.
TEST(DicomSeries, NumbersMayHaveASignAndSpaces) {
  const ScratchFolder folder;
  for (int n = 0; n < 3; ++n) {
    WriteCtSlice(folder.path() / (std::to_string(n) + ".dcm"),
                 {.slice = n, .position = "+0\\ -1.5 \\ +" + std::to_string(2 * n)});
  }
  const Grid grid = ReadScan(folder.path()).volume.grid;
  EXPECT_EQ(grid.size.z(), 3);
  EXPECT_NEAR(grid.spacing_mm.z(), 2, 1e-9);
  EXPECT_NEAR(grid.origin.lps.y(), -1.5, 1e-9);
}

// The decoder takes one slope for all frames of an image.
TEST(DicomSeries, AnImageWhoseFramesAreRescaledDifferentlyIsRefused) {
  const ScratchFolder folder;
  const auto frame = [](int place, const std::string& slope) {
    return DicomBytes()
        .Sequence(0x00209113, {DicomBytes().Text(0x00200032, "DS", "0\\0\\" + std::to_string(place))})
        .Sequence(0x00289145, {DicomBytes().Text(0x00281052, "DS", "0").Text(0x00281053, "DS", slope)});
  };
  const auto complaint = [&](const std::string& second_slope) {
    DicomBytes image;
    image.Text(0x00080060, "CS", "MR").Text(0x0020000e, "UI", "2.25.4").Text(0x00280008, "IS", "2");
    image.Short(0x00280010, 2).Short(0x00280011, 2).Short(0x00280100, 16);
    image.Sequence(0x52009229,
                   {DicomBytes()
                        .Sequence(0x00209116, {DicomBytes().Text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")})
                        .Sequence(0x00289110, {DicomBytes().Text(0x00280030, "DS", "1\\1")})});
    image.Sequence(0x52009230, {frame(0, "1"), frame(1, second_slope)});
    image.WriteTo(folder.path() / "frames.dcm");
    return Complaint(folder.path() / "frames.dcm");
  };
  EXPECT_THAT(complaint("2"), HasSubstr("rescaled differently"));
  EXPECT_THAT(complaint("1"), testing::Not(HasSubstr("rescaled differently")));
}

// Of hundreds of slices on a network's disk each header is read once, not for a segmentation and again.
TEST(DicomSeries, SlicesThatAreALabelMapAreLookedAtOnce) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, "1");
  EXPECT_EQ(ReadLabelsGrid(folder.path()).size, Eigen::Vector3i(2, 2, 3));
  const std::vector<DicomFile> headers = ReadDicomHeaders(folder.path());
  ASSERT_EQ(headers.size(), 3u);
  for (const DicomFile& file : headers) std::filesystem::resize_file(file.path, 0);
  EXPECT_FALSE(FindDicomSegmentsGrid(headers)) << "without another look at them";
  EXPECT_EQ(ScanFiles(headers).size(), 3u);
}

TEST(DicomSeries, WhatIsNotOfTheBodyBesideAScanDoesNotCount) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), slice, "1");
  WriteSegmentation(folder.path() / "one.dcm", 1);
  WriteSegmentation(folder.path() / "four.dcm", 4);
  EXPECT_EQ(ReadScan(folder.path()).volume.grid.size, Eigen::Vector3i(2, 2, 3));
  EXPECT_EQ(ReadVolumeInfo(folder.path()).grid.size, Eigen::Vector3i(2, 2, 3));
  std::filesystem::remove(folder.path() / "four.dcm");  // of the same series, and the same places
  EXPECT_EQ(ReadLabels(folder.path()).grid.size, Eigen::Vector3i(8, 8, 3)) << "the segmentation is meant";
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  std::filesystem::remove(folder.path() / "one.dcm");
  const auto dose = SharedData() / "dicom-odd/test_files/rtdose.dcm";
  std::filesystem::copy(dose, folder.path() / "dose.dcm");
  EXPECT_EQ(ReadScan(folder.path()).volume.grid.size, Eigen::Vector3i(2, 2, 3));
  EXPECT_THAT(Complaint(dose), HasSubstr("doses"));
}

}  // namespace
}  // namespace kvx
