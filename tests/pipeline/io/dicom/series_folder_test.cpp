// Which files of a folder may belong to its series.
#include "pipeline/io/dicom/series_folder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

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

TEST(SeriesFolder, AHeadIsAsLongAsItsFile) {
  const testing_support::ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "IM1";
  std::ofstream(file) << "short";
  EXPECT_EQ(HeadOf(file), "short");
  EXPECT_EQ(HeadOf(file, 3), "sho");
  EXPECT_EQ(HeadOf(folder.path() / "IM2"), "");
  EXPECT_EQ(SeriesFileAt(file), SeriesFile::kAside) << "plain text";
  std::ofstream(folder.path() / "IM2.dcm") << "short";
  EXPECT_EQ(SeriesFileAt(folder.path() / "IM2.dcm"), SeriesFile::kBroken);
}

}  // namespace
}  // namespace kvx
