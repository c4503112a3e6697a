// One machine at a time; what a restart, a crash or a copy leaves behind is in nobody's way.
#include "storage/data_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

// As a worker on another machine that shares the folder holds it: the lock, and the name of its start.
class HeldElsewhere {
 public:
  HeldElsewhere(const std::filesystem::path& root, const std::string& boot)
      : file_(::open((root / "workers.lock").c_str(), O_RDWR | O_CREAT, 0600)) {
    EXPECT_EQ(::ftruncate(file_, 0), 0);
    EXPECT_EQ(::pwrite(file_, boot.data(), boot.size(), 0), ssize_t(boot.size()));
    EXPECT_EQ(::flock(file_, LOCK_SH | LOCK_NB), 0);
  }
  ~HeldElsewhere() { ::close(file_); }

 private:
  int file_;
};

constexpr char kOtherBoot[] = "11111111-2222-3333-4444-555555555555";

TEST(DataFolder, WhatAnotherMachineUsesIsRefused) {
  const testing_support::ScratchFolder scratch;
  const HeldElsewhere other(scratch.path(), kOtherBoot);
  EXPECT_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker), Conflict);
  EXPECT_THROW(DataFolder(scratch.path(), DataFolder::Use::kService), Conflict);
}

// The lock went with its process; what it said is of no more account.
TEST(DataFolder, ARestartACrashOrACopyRefusesNobody) {
  for (const auto use : {DataFolder::Use::kWorker, DataFolder::Use::kService}) {
    const testing_support::ScratchFolder scratch;
    { const HeldElsewhere before(scratch.path(), kOtherBoot); }
    const DataFolder first(scratch.path(), use);
    if (use == DataFolder::Use::kService) continue;
    EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker)) << "the first one said where it is";
    EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kService));
  }
}

TEST(DataFolder, BesideAWorkerOfAnOlderProgramWorkGoesOn) {
  const testing_support::ScratchFolder scratch;
  const HeldElsewhere older(scratch.path(), "");
  EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kWorker));
  EXPECT_NO_THROW(DataFolder(scratch.path(), DataFolder::Use::kService));
}

}  // namespace
}  // namespace kvx
