// Names and first bytes of what lies in folders of exports.
#include "core/text/series_file.h"

#include <gtest/gtest.h>

#include <string>

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

TEST(SeriesFile, OnlyItsFirstBytesTell) {
  const std::string text(kSeriesFileHead, 'a');
  EXPECT_EQ(SeriesFileOf("IM0001", text + '\0'), SeriesFile::kAside);
}

TEST(SeriesFile, WhatSystemsAndMediaAddGoesAside) {
  for (const char* name : {".DS_Store", "__MACOSX", "DICOMDIR", "a/DICOMDIR", ".old/IM1", "./a/.old/b/IM1"})
    EXPECT_TRUE(IsNamedAside(name)) << name;
  for (const char* name : {"IM0001", "./IM1", "DICOMDIR_1/IM1"}) EXPECT_FALSE(IsNamedAside(name)) << name;
}

}  // namespace
}  // namespace kvx
