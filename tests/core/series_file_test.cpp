// Names and first bytes of what lies in folders of exports.
#include "core/series_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

TEST(SeriesFile, IsAnImageByItsMarkWhateverItIsCalled) {
  const std::string image = std::string(128, '\0') + "DICM" + std::string(20, '\2');
  for (const char* name : {"IM0001", "1.2.840.7", "slice.dcm", "notes.txt", "README"})
    EXPECT_EQ(SeriesFileOf(name, image), SeriesFile::kImage) << name;
}

TEST(SeriesFile, WithoutTheMarkNameAndBytesTell) {
  const std::string zeros(100, '\0'), text = "Scans of the left knee.\r\nÄrztin: -";
  for (const char* name : {"IM0001", "1.2.840.7"}) {
    EXPECT_EQ(SeriesFileOf(name, zeros), SeriesFile::kBroken) << name << ", cut off";
    EXPECT_EQ(SeriesFileOf(name, ""), SeriesFile::kBroken) << name << ", empty";
    EXPECT_EQ(SeriesFileOf(name, zeros + zeros), SeriesFile::kBroken) << name << ", of an old program";
    EXPECT_EQ(SeriesFileOf(name, text), SeriesFile::kAside) << name;
  }
  for (const char* name : {"a.dcm", "A.DCM", "a.IMA", "a.dicom", "a.img"}) {
    EXPECT_EQ(SeriesFileOf(name, text), SeriesFile::kBroken) << name;
    EXPECT_EQ(SeriesFileOf(name, ""), SeriesFile::kBroken) << name;
  }
  for (const char* name : {"viewer.exe", "preview.jpg", "Thumbs.db"})
    EXPECT_EQ(SeriesFileOf(name, zeros), SeriesFile::kAside) << name;
}

TEST(SeriesFile, WhatSystemsAndMediaAddGoesAside) {
  for (const char* name : {".DS_Store", "__MACOSX", "DICOMDIR", "a/DICOMDIR", ".old/IM1", "./a/.old/b/IM1"})
    EXPECT_TRUE(IsNamedAside(name)) << name;
  for (const char* name : {"IM0001", "./IM1", "DICOMDIR_1/IM1"}) EXPECT_FALSE(IsNamedAside(name)) << name;
}

TEST(SeriesFiles, AreThoseOfAllFoldersButSuchAsGoAside) {
  const testing_support::ScratchFolder folder;
  for (const char* name : {"IM3", "DICOMDIR_1/IM1", "DICOMDIR_1/DICOMDIR", ".old/IM2", "more/.DS_Store"}) {
    std::filesystem::create_directories((folder.path() / name).parent_path());
    std::ofstream(folder.path() / name) << "a file";
  }
  std::filesystem::create_symlink("IM3", folder.path() / "IM4");
  const std::vector<std::filesystem::path> files{folder.path() / "DICOMDIR_1/IM1", folder.path() / "IM3",
                                                 folder.path() / "IM4"};
  EXPECT_EQ(SeriesFiles(folder.path()), files);
}

TEST(SeriesFiles, ALinkToAnImageThatIsNotThereIsNoticed) {
  const testing_support::ScratchFolder folder;
  for (const char* name : {"report.pdf", ".IM1"})
    std::filesystem::create_symlink("gone", folder.path() / name);
  EXPECT_TRUE(SeriesFiles(folder.path()).empty());
  for (const char* name : {"IM1", "1.2.840.7", "a.DCM"}) {
    std::filesystem::create_symlink("gone", folder.path() / name);
    EXPECT_THROW(SeriesFiles(folder.path()), InputError) << name;
    std::filesystem::remove(folder.path() / name);
  }
}

}  // namespace
}  // namespace kvx
