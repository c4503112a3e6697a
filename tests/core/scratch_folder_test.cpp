// The folders of the tests themselves: what a killed test left is no other test's.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

// What ends without removing its folder leaves it in that of the program, which goes with the program.
TEST(ScratchFolder, LiesInOneOfTheProgramAlsoInADeathTest) {
  const std::filesystem::path all = ScratchFolder().path().parent_path();
  const auto end = [] {
    const ScratchFolder folder;
    std::fprintf(stderr, "%s", folder.path().parent_path().c_str());
    std::_Exit(2);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(end(), testing::ExitedWithCode(2), all.string());
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
