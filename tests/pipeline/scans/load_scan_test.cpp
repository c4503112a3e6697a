// Digests of files and folders, and the stage that loads.
#include "pipeline/scans/load_scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/segmentation/segment_bones.h"
#include "tests/support/dicom_bytes.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

void Put(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

TEST(ContentDigest, OfAFileIsItsSha256) {
  const ScratchFolder folder;
  Put(folder.path() / "a", "abc");  // the standard's own example
  EXPECT_EQ(ContentDigest(folder.path() / "a").Hex(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  const std::string longer(3'000'001, 'x');
  Put(folder.path() / "b", longer);
  EXPECT_EQ(ContentDigest(folder.path() / "b"), Sha256(longer)) << "more than one chunk";
  EXPECT_THROW(ContentDigest(folder.path() / "none"), InputError);
}

TEST(ContentDigest, OfAFolderSeesNamesAndBytesButNotItsPlace) {
  const ScratchFolder folder;
  for (const char* copy : {"p", "q"}) {
    Put(folder.path() / copy / "1.dcm", "one");
    Put(folder.path() / copy / "sub/2.dcm", "two");
  }
  const Digest p = ContentDigest(folder.path() / "p");
  EXPECT_EQ(p, ContentDigest(folder.path() / "q"));
  Put(folder.path() / "q/sub/2.dcm", "tow");
  EXPECT_NE(p, ContentDigest(folder.path() / "q"));
  Put(folder.path() / "q/sub/2.dcm", "two");
  std::filesystem::rename(folder.path() / "q/1.dcm", folder.path() / "q/3.dcm");
  EXPECT_NE(p, ContentDigest(folder.path() / "q"));
}

TEST(ContentDigest, DoesNotSeeWhatTheReaderLeavesAside) {
  const ScratchFolder folder;
  Put(folder.path() / "1.dcm", "one");
  const Digest before = ContentDigest(folder.path());
  for (const char* aside : {".DS_Store", "._1.dcm", "DICOMDIR", ".git/config"})
    Put(folder.path() / aside, "a desktop's");
  EXPECT_EQ(ContentDigest(folder.path()), before);
  Put(folder.path() / "2.dcm", "two");
  EXPECT_NE(ContentDigest(folder.path()), before);
}

TEST(LabelsDigest, OfAFolderIsOfTheMasksOfItsBones) {
  const ScratchFolder folder;
  const std::vector<StudyBone> bones{{1, "femur", ""}, {2, "tibia", "femur"}};
  Put(folder.path() / "femur.nii.gz", "one");
  WriteVolume(folder.path() / "tibia.mhd", LinearRamp{}.On(ObliqueGrid()), ScalarType::kFloat32);
  const Digest before = LabelsDigest(folder.path(), bones);
  for (const char* other : {"liver.nii.gz", ".DS_Store", "report.txt"}) Put(folder.path() / other, "other");
  EXPECT_EQ(LabelsDigest(folder.path(), bones), before);
  Put(folder.path() / "tibia.raw", "other voxels");
  EXPECT_NE(LabelsDigest(folder.path(), bones), before);
  EXPECT_EQ(LabelsDigest(folder.path() / "femur.nii.gz", bones), Sha256("one"));
}

TEST(LabelsDigest, OfAFolderWithoutMasksIsOfItsImages) {
  const ScratchFolder folder;
  WriteCtSlice(folder.path() / "1.dcm", 0, "1");
  const Digest before = LabelsDigest(folder.path(), {{1, "femur", ""}});
  EXPECT_EQ(before, ContentDigest(folder.path()));
  WriteCtSlice(folder.path() / "2.dcm", 1, "1");
  EXPECT_NE(LabelsDigest(folder.path(), {{1, "femur", ""}}), before);
}

TEST(ContentDigest, SeesTheVoxelsBesideAHeader) {
  const ScratchFolder folder;
  const auto header = folder.path() / "scan.mhd";
  WriteVolume(header, LinearRamp{}.On(ObliqueGrid()), ScalarType::kFloat32);
  const Digest before = ContentDigest(header);
  EXPECT_EQ(ContentDigest(header), before);
  ASSERT_TRUE(std::filesystem::exists(folder.path() / "scan.raw"));
  std::fstream voxels(folder.path() / "scan.raw", std::ios::in | std::ios::out | std::ios::binary);
  voxels.put('!');
  voxels.close();
  EXPECT_NE(ContentDigest(header), before);
  std::filesystem::remove(folder.path() / "scan.raw");
  EXPECT_THROW(ContentDigest(header), InputError);
}

TEST(LoadScan, GivesTheScanAndFindsItAgain) {
  const ScratchFolder folder;
  const Volume ramp = LinearRamp{}.On(ObliqueGrid());
  WriteVolume(folder.path() / "scan.nii.gz", ramp, ScalarType::kFloat32);
  StageContext context{SharedBackend(), Progress()};
  const LoadScan::Inputs inputs{ContentDigest(folder.path() / "scan.nii.gz"), folder.path() / "scan.nii.gz"};
  EXPECT_EQ(LoadScan::Run(inputs, {}, context).volume.values, ramp.values);
}

TEST(LoadScan, RefusesAScanThatShowsNothing) {
  const ScratchFolder folder;
  const auto path = folder.path() / "even.nii.gz";
  WriteVolume(path, Volume(ObliqueGrid(), 7), ScalarType::kInt16);
  StageContext context{SharedBackend(), Progress()};
  EXPECT_THROW(LoadScan::Run({ContentDigest(path), path}, {}, context), InputError);
}

// A byte that got lost shifts all numbers behind it. A single one is a hot voxel.
TEST(ReadScanEvenly, GreysThatNothingMeasuresAreRefused) {
  const ScratchFolder folder;
  Volume scan = LinearRamp{}.On(ObliqueGrid());
  scan.values[200] = 3e38f;
  WriteVolume(folder.path() / "scan.nii", scan, ScalarType::kFloat32);
  EXPECT_EQ(ReadScanEvenly(folder.path() / "scan.nii").volume.values, scan.values);
  for (size_t v = 0; v < scan.values.size(); v += 50) scan.values[v] = v % 100 ? 3e38f : -3e38f;
  WriteVolume(folder.path() / "scan.nii", scan, ScalarType::kFloat32);
  EXPECT_THROW(ReadScanEvenly(folder.path() / "scan.nii"), InputError);
}

// Slices of air, soft tissue, soft tissue and bone, as stored; with their rescale, and without it.
TEST(ReadScanEvenly, ACtWithoutItsRescaleIsOfUnknownModality) {
  const ScratchFolder folder;
  const auto write = [&](const char* intercept) {
    for (int slice = 0; slice < 4; ++slice) {
      const int stored = std::array{24, 1064, 1074, 1724}[size_t(slice)];
      std::string voxels;
      for (int v = 0; v < 4; ++v) voxels += {char(stored & 255), char(stored >> 8)};
      WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"),
                   {.slice = slice, .intercept = intercept, .voxels = voxels});
    }
  };
  write("-1024");
  const Scan whole = ReadScanEvenly(folder.path());
  EXPECT_EQ(whole.modality, "CT");
  EXPECT_FALSE(whole.denied_ct);
  EXPECT_NO_THROW(RequireThreshold(whole, 300));
  for (const double level_hu : {0.0, -2000.0, 59.0}) {  // 0 as some tools have for "automatic"
    EXPECT_THAT([&] { RequireThreshold(whole, level_hu); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr("or auto")));
  }
  EXPECT_NO_THROW(RequireThreshold(whole, 60));
  write("0");
  const Scan stripped = ReadScanEvenly(folder.path());
  EXPECT_EQ(stripped.modality, "");
  EXPECT_TRUE(stripped.denied_ct);
  EXPECT_THROW(RequireThreshold(stripped, 300), InputError);
  EXPECT_THROW(RequireThreshold(ReadScan(folder.path()), 300), InputError);
}

// A file that does not say so is a CT by its air, which a crop may lack.
TEST(ReadScanEvenly, AThresholdSaysWhatACtIsKnownBy) {
  Scan scan;
  scan.volume = Volume(ObliqueGrid());
  for (size_t v = 0; v < scan.volume.values.size(); ++v) scan.volume.values[v] = float(v % 1200) - 100;
  EXPECT_THAT([&] { RequireThreshold(scan, 300); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("air below -500")));
  scan.modality = "CT";
  EXPECT_NO_THROW(RequireThreshold(scan, 300));
}

TEST(ReadScanEvenly, WhatLiesOutsideTheFieldOfViewIsDark) {
  const ScratchFolder folder;
  Volume scan(ObliqueGrid());
  for (size_t v = 0; v < scan.values.size(); ++v) scan.values[v] = float(v % 97);
  std::fill_n(scan.values.begin(), 300, -1000.0f);
  WriteVolume(folder.path() / "scan.nii.gz", scan, ScalarType::kFloat32);
  std::fill_n(scan.values.begin(), 300, 0.0f);
  EXPECT_EQ(ReadScanEvenly(folder.path() / "scan.nii.gz").volume.values, scan.values);
}

}  // namespace
}  // namespace kvx
