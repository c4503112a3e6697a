// The folders of the tests themselves: what a killed test left is no other test's.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::FilesUnder;
using testing_support::ScratchFolder;

// The system gives a process the number of one that has ended, so a number makes no name.
TEST(ScratchFolder, IsEmptyWhateverAnEndedProcessOfTheSameNumberLeft) {
  std::vector<std::filesystem::path> left;
  for (int serial = 0; serial < 9; ++serial) {
    left.push_back(std::filesystem::temp_directory_path() /
                   ("kinevox-test-" + std::to_string(getpid()) + "-" + std::to_string(serial)));
    std::filesystem::create_directory(left.back());
    std::ofstream(left.back() / "left") << "x";
  }
  EXPECT_EQ(FilesUnder(ScratchFolder().path()), 0u);
  for (const auto& folder : left) std::filesystem::remove_all(folder);
}

TEST(ScratchFolder, TwoAreTwo) {
  const ScratchFolder one, other;
  EXPECT_NE(one.path(), other.path());
  EXPECT_TRUE(std::filesystem::is_directory(one.path()));
}

TEST(ScratchFolder, IsRemovedWithWhatLiesInIt) {
  std::filesystem::path path;
  {
    const ScratchFolder folder;
    path = folder.path();
    std::ofstream(path / "a") << "x";
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace kvx
