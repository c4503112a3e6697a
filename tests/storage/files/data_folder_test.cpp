// One machine and one version at a time; what a restart, a crash or a copy leaves behind is in nobody's way.
#include "storage/files/data_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/errors.h"
#include "core/version.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

// As a worker on another machine that shares the folder, or of another version, holds it: the lock, and what
// it says.
class HeldByOther {
 public:
  HeldByOther(const std::filesystem::path& root, const std::string& said)
      : file_(::open((root / "workers.lock").c_str(), O_RDWR | O_CREAT, 0600)) {
    EXPECT_EQ(::ftruncate(file_, 0), 0);
    EXPECT_EQ(::pwrite(file_, said.data(), said.size(), 0), ssize_t(said.size()));
    EXPECT_EQ(::flock(file_, LOCK_SH | LOCK_NB), 0);
  }
  ~HeldByOther() { ::close(file_); }

 private:
  int file_;
};

constexpr char kOtherBoot[] = "11111111-2222-3333-4444-555555555555";

TEST(DataFolder, RoomIsWhatIsFreeBeyondTheReserve) {
  const testing_support::ScratchFolder scratch;
  const DataFolder data(scratch.path() / "data");
  const int64_t free_bytes = int64_t(data.FreeBytes()), some = free_bytes / 2;
  EXPECT_TRUE(data.HasRoom(uintmax_t(some), 0));
  EXPECT_FALSE(data.HasRoom(uintmax_t(some), free_bytes));
  EXPECT_FALSE(data.HasRoom(uintmax_t(free_bytes + some), 0));
  EXPECT_TRUE(data.HasRoom(uintmax_t(some), -free_bytes)) << "if so much went";
}

TEST(DataFolder, WhatAnotherMachineUsesIsRefused) {
  const testing_support::ScratchFolder scratch;
  const HeldByOther other(scratch.path(), kOtherBoot);
  EXPECT_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker), Conflict);
  EXPECT_THROW(DataFolder(scratch.path(), DataFolder::Use::kService), Conflict);
}

// The lock went with its process; what it said is of no more account.
TEST(DataFolder, ARestartACrashOrACopyRefusesNobody) {
  for (const auto use : {DataFolder::Use::kWorker, DataFolder::Use::kService}) {
    const testing_support::ScratchFolder scratch;
    { const HeldByOther before(scratch.path(), kOtherBoot); }
    const DataFolder first(scratch.path(), use);
    if (use == DataFolder::Use::kService) continue;
    EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker)) << "the first one said where it is";
    EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kService));
  }
}

// All that a service has built is one version's.
TEST(DataFolder, BesideAnotherVersionNothingStarts) {
  const std::string here = testing_support::Content("/proc/sys/kernel/random/boot_id").substr(0, 36);
  for (const std::string& said : {here, here + "\n0.1.0", std::string("\n0.1.0")}) {
    const testing_support::ScratchFolder scratch;
    const HeldByOther other(scratch.path(), said);
    EXPECT_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker), Conflict) << said;
    EXPECT_THROW(DataFolder(scratch.path(), DataFolder::Use::kService), Conflict) << said;
  }
  const testing_support::ScratchFolder scratch;
  const HeldByOther same(scratch.path(), here + "\n" + ProgramVersion());
  EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker));
  EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kService));
}

TEST(DataFolder, BesideAWorkerThatSaysNothingWorkGoesOn) {
  const testing_support::ScratchFolder scratch;
  const HeldByOther silent(scratch.path(), "");
  EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker));
  EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kService));
}

}  // namespace
}  // namespace kvx
