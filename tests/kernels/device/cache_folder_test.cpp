// Compiled kernels are kept where nobody else can put some, with a home folder and without.
#include "kernels/device/cache_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>

#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

using std::filesystem::path;
using std::filesystem::perms;

class CacheFolder : public testing::Test {
 protected:
  CacheFolder() {
    for (const char* name : {"HOME", "XDG_CACHE_HOME", "KVX_KERNEL_CACHE", "POCL_CACHE_DIR", "TMPDIR"}) {
      const char* value = std::getenv(name);
      before_[name] = value ? std::optional<std::string>(value) : std::nullopt;
      ::unsetenv(name);
    }
    ::setenv("TMPDIR", scratch_.path().c_str(), 1);
  }
  ~CacheFolder() override {
    for (const auto& [name, value] : before_)
      value ? ::setenv(name.c_str(), value->c_str(), 1) : ::unsetenv(name.c_str());
  }

  testing_support::ScratchFolder scratch_;

 private:
  std::map<std::string, std::optional<std::string>> before_;
};

TEST_F(CacheFolder, IsInTheHomeFolderUnlessTheUserNamesOne) {
  ::setenv("HOME", scratch_.path().c_str(), 1);
  EXPECT_EQ(DefaultProgramFolder(), scratch_.path() / ".cache/kinevox/kernels");
  ::setenv("XDG_CACHE_HOME", "/some", 1);
  EXPECT_EQ(DefaultProgramFolder(), "/some/kinevox/kernels");
  ::setenv("KVX_KERNEL_CACHE", "/other", 1);
  EXPECT_EQ(DefaultProgramFolder(), "/other");
}

TEST_F(CacheFolder, IsTheUsersOwnWithoutAHome) {
  const path folder = DefaultProgramFolder();
  const path own = folder.parent_path().parent_path();
  EXPECT_EQ(own.parent_path(), scratch_.path());
  EXPECT_EQ(status(own).permissions(), perms::owner_all);
  GivePoclAFolder();
  ASSERT_TRUE(std::getenv("POCL_CACHE_DIR"));
  EXPECT_EQ(path(std::getenv("POCL_CACHE_DIR")).parent_path(), own);
}

// Not even root can.
TEST_F(CacheFolder, IsTheUsersOwnWhereTheHomeMayNotBeEntered) {
  create_directory_symlink("home", scratch_.path() / "home");
  ::setenv("HOME", (scratch_.path() / "home").c_str(), 1);
  EXPECT_EQ(DefaultProgramFolder().parent_path().parent_path().parent_path(), scratch_.path());
}

TEST_F(CacheFolder, IsNoneWhereOthersMayWriteToIt) {
  const path own = DefaultProgramFolder().parent_path().parent_path();
  permissions(own, perms::others_write, std::filesystem::perm_options::add);
  EXPECT_EQ(DefaultProgramFolder(), path());
  GivePoclAFolder();
  EXPECT_FALSE(std::getenv("POCL_CACHE_DIR"));
}

TEST_F(CacheFolder, OfPoclIsInTheHomeFolderUnlessTheUserNamesOne) {
  ::setenv("HOME", scratch_.path().c_str(), 1);
  ::setenv("POCL_CACHE_DIR", "", 1);  // PoCL aborts at it
  ::setenv("XDG_CACHE_HOME", "", 1);
  GivePoclAFolder();
  EXPECT_EQ(std::getenv("POCL_CACHE_DIR"), scratch_.path() / ".cache/pocl/kcache");
  EXPECT_NO_THROW(RequirePoclsFolder());
  ::setenv("POCL_CACHE_DIR", "/other", 1);
  GivePoclAFolder();
  EXPECT_STREQ(std::getenv("POCL_CACHE_DIR"), "/other");
}

TEST_F(CacheFolder, OfPoclIsTheUsersOwnWhereTheUsualOneIsAnothers) {
  ::setenv("HOME", scratch_.path().c_str(), 1);
  create_directory(scratch_.path() / ".cache");
  std::ofstream(scratch_.path() / ".cache/pocl") << "not even root can make a folder in it";
  GivePoclAFolder();
  ASSERT_TRUE(std::getenv("POCL_CACHE_DIR"));
  EXPECT_EQ(path(std::getenv("POCL_CACHE_DIR")).parent_path().parent_path(), scratch_.path());
  EXPECT_NO_THROW(RequirePoclsFolder());
}

TEST_F(CacheFolder, OfPoclNeedsRoom) {
  ::setenv("POCL_CACHE_DIR", scratch_.path().c_str(), 1);
  EXPECT_TRUE(PoclsFolderHasRoom());
  ::setenv("POCL_CACHE_DIR", "/proc/self", 1);  // no byte is free there
  EXPECT_FALSE(PoclsFolderHasRoom());
  const std::string refusal = testing_support::RefusalOf<Unavailable>([] { RequirePoclsRoom(); });
  EXPECT_THAT(refusal, testing::HasSubstr("nearly full"));
}

// Not even root can write there.
TEST_F(CacheFolder, ThatPoclCannotKeepCodeInIsRefused) {
  ::setenv("POCL_CACHE_DIR", "/proc/self", 1);
  const std::string refusal = testing_support::RefusalOf<Unavailable>([] { RequirePoclsFolder(); });
  EXPECT_THAT(refusal, testing::HasSubstr("POCL_CACHE_DIR"));
}

}  // namespace
}  // namespace kvx
