// Blobs are complete or absent; the same bytes lie once.
#include "storage/files/blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
using testing_support::FilesUnder;
using testing_support::ScratchFolder;

IncomingBlob Receive(BlobStore& store, const std::string& bytes, int64_t quota = 1 << 20) {
  IncomingBlob blob = store.Receive(".bin", quota);
  for (size_t i = 0; i < bytes.size(); i += 3)
    blob.Write(std::span(bytes).subspan(i, std::min<size_t>(3, bytes.size() - i)));
  return blob;
}

TEST(BlobStore, KeepsBytesUnderTheirDigestOnce) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  const std::string name = store.Keep(Receive(store, "abc"));
  EXPECT_EQ(name, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-2
  EXPECT_EQ(store.Keep(Receive(store, "abc")), name);
  EXPECT_EQ(FilesUnder(scratch.path()), 1u);
  EXPECT_EQ(testing_support::Content(store.PathOf(name)), "abc");
}

TEST(BlobStore, WhatIsNotKeptLeavesNothing) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  { const IncomingBlob blob = Receive(store, "half a fi"); }
  EXPECT_THROW(Receive(store, "far too long", 5), QuotaExceeded);
  EXPECT_EQ(FilesUnder(scratch.path()), 0u);
}

TEST(BlobStore, TheQuotaItselfMayBeSent) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  EXPECT_EQ(Receive(store, "12345", 5).bytes(), 5);
  EXPECT_THROW(Receive(store, "123456", 5), QuotaExceeded);
}

// There is an upload under way at every moment: a removal would wait for ever if later ones went first.
TEST(BlobStore, ARemovalThatWaitsGoesBeforeLaterUploads) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  std::mutex mutex;
  std::vector<std::string> order;
  const auto went = [&](const char* who) {
    const std::lock_guard lock(mutex);
    order.push_back(who);
  };
  auto upload = std::make_unique<std::shared_lock<std::shared_mutex>>(store.KeepRemovalOut());
  std::atomic<bool> asking{false};
  std::thread removal([&] {
    asking = true;
    const auto alone = store.KeepOthersOut();
    went("removal");
  });
  while (!asking) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // until it waits
  std::thread later([&] {
    const auto another = store.KeepRemovalOut();
    went("later upload");
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  went("upload");
  upload.reset();
  removal.join();
  later.join();
  EXPECT_EQ(order, (std::vector<std::string>{"upload", "removal", "later upload"}));
}

TEST(BlobStore, ACrashLeavesNoPartialBlob) {
  const ScratchFolder scratch;
  fs::create_directories(scratch.path() / "incoming");
  std::ofstream(scratch.path() / "incoming/in_left_by_a_crash.nii") << "half";
  BlobStore store(scratch.path());
  EXPECT_EQ(FilesUnder(scratch.path()), 0u);
}

// A folder on another disk than the scratch folders are: in memory.
class OtherDisk {
 public:
  OtherDisk() {
    std::string name = "/dev/shm/kinevox-test-XXXXXX";
    if (::mkdtemp(name.data())) path_ = name;
  }
  ~OtherDisk() {
    if (!path_.empty()) fs::remove_all(path_);
  }
  OtherDisk(const OtherDisk&) = delete;
  OtherDisk& operator=(const OtherDisk&) = delete;
  const fs::path& path() const { return path_; }
  bool IsOther(const fs::path& folder) const {
    struct stat here {};
    struct stat there {};
    return !path_.empty() && ::stat(path_.c_str(), &here) == 0 && ::stat(folder.c_str(), &there) == 0 &&
           here.st_dev != there.st_dev;
  }

 private:
  fs::path path_;
};

// As where a disk knows no links at all (exFAT).
TEST(BlobStore, WhatCannotBeLinkedIsCopied) {
  const ScratchFolder scratch;
  const OtherDisk disk;
  if (!disk.IsOther(scratch.path())) GTEST_SKIP() << "/dev/shm is no disk of its own";
  BlobStore store(scratch.path());
  std::ofstream(disk.path() / "upl_whole") << "abc";
  const std::string name = store.Keep(store.Adopt(disk.path() / "upl_whole", ".nii"));
  EXPECT_EQ(testing_support::Content(store.PathOf(name)), "abc");
  EXPECT_EQ(testing_support::Content(disk.path() / "upl_whole"), "abc") << "it is its owner's to remove";
  EXPECT_EQ(FilesUnder(scratch.path()), 1u);
}

TEST(BlobStore, PartsOnDifferentDisksAreRefused) {
  const ScratchFolder scratch;
  const OtherDisk disk;
  if (!disk.IsOther(scratch.path())) GTEST_SKIP() << "/dev/shm is no disk of its own";
  fs::create_directory_symlink(disk.path(), scratch.path() / "blobs");
  const std::string refusal = testing_support::RefusalOf<Unavailable>([&] { BlobStore(scratch.path()); });
  EXPECT_THAT(refusal, testing::HasSubstr("different disks"));
}

TEST(BlobStore, FoldersAreKeptUnderTheDigestOfTheirFiles) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  const auto keep = [&](const std::string& second) {
    IncomingFolder folder = store.ReceiveFolder();
    std::ofstream(folder.path() / "1") << "one";
    std::ofstream(folder.path() / "2") << second;
    return store.KeepFolder(std::move(folder));
  };
  const std::string name = keep("two");
  EXPECT_EQ(keep("two"), name);
  EXPECT_NE(keep("three"), name);
  EXPECT_EQ(FilesUnder(scratch.path()), 4u);
}

TEST(BlobStore, BytesThatCameAgainReplaceDamagedOnes) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  const auto keep_file = [&] { return store.Keep(Receive(store, "abc")); };
  const auto keep_folder = [&] {
    IncomingFolder folder = store.ReceiveFolder();
    std::ofstream(folder.path() / "1") << "one";
    std::ofstream(folder.path() / "2") << "two";
    return store.KeepFolder(std::move(folder));
  };
  const fs::path file = store.PathOf(keep_file()), folder = store.PathOf(keep_folder());
  EXPECT_TRUE(IsIntact(file));
  EXPECT_TRUE(IsIntact(folder));
  for (const char* damaged : {"abd", "ab", ""}) {
    std::ofstream(file) << damaged;
    EXPECT_FALSE(IsIntact(file)) << damaged;
  }
  fs::remove(folder / "2");
  EXPECT_FALSE(IsIntact(folder));
  keep_file();
  keep_folder();
  EXPECT_TRUE(IsIntact(file));
  EXPECT_TRUE(IsIntact(folder));
  EXPECT_EQ(FilesUnder(scratch.path()), 3u);
  EXPECT_FALSE(IsIntact(scratch.path() / "nowhere"));
}

}  // namespace
}  // namespace kvx
