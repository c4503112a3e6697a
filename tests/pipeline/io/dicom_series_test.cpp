// DICOM series against the NIfTI answers that another program gave, voxel by voxel at the same place in the
// patient.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

std::filesystem::path Set(const std::string& name) { return SharedData() / "dicom-d2n" / name; }

std::string Complaint(const std::filesystem::path& path) {
  try {
    ReadScan(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
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

}  // namespace
}  // namespace kvx
