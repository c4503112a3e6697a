// Files are complete or absent, whatever happens while they are written.
#include "pipeline/artifacts/replace_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

std::string Content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string((std::istreambuf_iterator<char>(file)), {});
}

size_t Files(const std::filesystem::path& folder) {
  return size_t(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(ReplaceFile, WritesAndReplaces) {
  const testing_support::ScratchFolder scratch;
  ReplaceFile(scratch.path() / "a.txt", "one");
  ReplaceFile(scratch.path() / "a.txt", std::string_view("t\0o", 3));
  EXPECT_EQ(Content(scratch.path() / "a.txt"), std::string("t\0o", 3));
  EXPECT_EQ(Files(scratch.path()), 1u);
}

TEST(ReplaceFile, AFailedWriteKeepsWhatWasThere) {
  const testing_support::ScratchFolder scratch;
  ReplaceFile(scratch.path() / "a.nii.gz", "one");
  const auto fail = [](const std::filesystem::path& temporary) {
    EXPECT_TRUE(temporary.string().ends_with(".nii.gz"));
    std::ofstream(temporary) << "half";
    throw InputError("no");
  };
  EXPECT_THROW(ReplaceFileBy(scratch.path() / "a.nii.gz", fail), InputError);
  EXPECT_EQ(Content(scratch.path() / "a.nii.gz"), "one");
  EXPECT_EQ(Files(scratch.path()), 1u);
}

TEST(ReplaceFile, AMissingFolderIsAnError) {
  const testing_support::ScratchFolder scratch;
  EXPECT_THROW(ReplaceFile(scratch.path() / "none" / "a.txt", "one"), Unavailable);
}

}  // namespace
}  // namespace kvx
