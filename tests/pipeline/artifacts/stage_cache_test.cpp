// What is stored comes back to the byte, of any size; damage anywhere in it is noticed.
#include "pipeline/artifacts/stage_cache.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zstd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <new>
#include <random>

#include "core/errors.h"
#include "pipeline/artifacts/leftovers.h"
#include "tests/support/fixtures.h"
#include "tests/support/scarce_memory.h"

// There where the program is built with the sanitizer of undefined behaviour, which defines no macro.
extern "C" __attribute__((weak)) void __ubsan_handle_dynamic_type_cache_miss();

namespace kvx {
namespace {

constexpr size_t kSeveralFrames = 9'000'001;  // bytes: packed in pieces of 4 MiB

// Half of it packs well, half does not.
std::string Bytes(size_t count) {
  std::mt19937 random(5);
  std::string bytes(count, 'a');
  for (size_t n = count / 2; n < count; ++n) bytes[n] = char(random());
  return bytes;
}

class StageCacheTest : public testing::Test {
 protected:
  std::filesystem::path FileOf(const Digest& key) const {
    return cache_.folder() / key.Hex().substr(0, 2) / (key.Hex() + ".kva");
  }
  testing_support::ScratchFolder scratch_;
  StageCache cache_{scratch_.path() / "artifacts"};
  Digest key_ = Sha256("key");
};

TEST_F(StageCacheTest, BytesOfAnySizeComeBack) {
  for (const size_t count : {size_t(0), size_t(1), size_t(1) << 22, kSeveralFrames}) {
    const std::string bytes = Bytes(count);
    cache_.Write(key_, bytes);
    const auto back = cache_.Read(key_);
    ASSERT_TRUE(back) << count;
    EXPECT_TRUE(back->view() == bytes) << count;
    EXPECT_TRUE(cache_.Intact(key_));
  }
}

TEST_F(StageCacheTest, TheSameBytesMakeTheSameFile) {
  const std::string bytes = Bytes(kSeveralFrames);
  cache_.Write(key_, bytes);
  const auto first = cache_.BytesDigest(key_);
  cache_.Write(key_, bytes);
  ASSERT_TRUE(first);
  EXPECT_EQ(cache_.BytesDigest(key_), first);
}

TEST_F(StageCacheTest, WhatIsNotSyncedIsAsWhole) {
  cache_.WriteUnsynced(key_, "seconds");
  ASSERT_TRUE(cache_.Read(key_));
  EXPECT_EQ(cache_.Read(key_)->view(), "seconds");
}

TEST_F(StageCacheTest, DamageInAnyPartIsNoticed) {
  cache_.Write(key_, Bytes(kSeveralFrames));
  const auto length = std::filesystem::file_size(FileOf(key_));
  for (const uintmax_t at : {uintmax_t(1), uintmax_t(20), length / 2, length - 1}) {
    cache_.Write(key_, Bytes(kSeveralFrames));
    std::fstream file(FileOf(key_), std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(std::streamoff(at));
    const char before = char(file.get());
    file.seekp(std::streamoff(at));
    file.put(char(before ^ 1));
    file.close();
    EXPECT_FALSE(cache_.Read(key_)) << at;
  }
}

TEST_F(StageCacheTest, WhatKilledProcessesLeftIsRemoved) {
  cache_.Write(key_, "whole");
  const pid_t ended = fork();
  if (ended == 0) _exit(0);
  waitpid(ended, nullptr, 0);
  const auto of = [&](pid_t process) {
    const std::filesystem::path file = FileOf(key_).string() + "." + std::to_string(process) + ".7";
    std::ofstream(file) << "half";
    return file;
  };
  const auto left = of(ended), under_way = of(getpid()), old = of(getppid());
  std::filesystem::last_write_time(old,
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(25));
  RemoveLeftovers(cache_.folder());
  EXPECT_FALSE(std::filesystem::exists(left));
  EXPECT_FALSE(std::filesystem::exists(old));
  EXPECT_TRUE(std::filesystem::exists(under_way));
  EXPECT_TRUE(cache_.Intact(key_));
  RemoveLeftovers(scratch_.path() / "none yet");
}

// Of a process in another container, whose number says nothing here.
TEST_F(StageCacheTest, WhatSomebodyStillWritesStays) {
  cache_.Write(key_, "whole");
  const pid_t ended = fork();
  if (ended == 0) _exit(0);
  waitpid(ended, nullptr, 0);
  const std::string file = FileOf(key_).string() + "." + std::to_string(ended) + ".7";
  const int held = ::open(file.c_str(), O_WRONLY | O_CREAT, 0600);
  ::flock(held, LOCK_SH);
  RemoveLeftovers(cache_.folder());
  EXPECT_TRUE(std::filesystem::exists(file));
  ::close(held);
}

TEST_F(StageCacheTest, AFileThatCannotTakeItsPlaceLeavesNothing) {
  std::filesystem::create_directories(FileOf(key_) / "in the way");
  EXPECT_THROW(cache_.Write(key_, "whole"), Unavailable);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(FileOf(key_).parent_path()), {}), 1);
}

TEST_F(StageCacheTest, WantOfMemoryIsToldAsSuch) {
  if (!KVX_MEMORY_CAN_BE_SCARCE) GTEST_SKIP();
  const auto write = [&] {
    const std::string bytes = Bytes(100'000);
    testing_support::GetNoMoreMemoryThan(1 << 18);  // zstd takes more
    try {
      cache_.Write(key_, bytes);
    } catch (const std::bad_alloc&) {
      std::exit(2);
    }
    std::exit(0);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(write(), testing::ExitedWithCode(2), "");
}

TEST_F(StageCacheTest, WhatCannotBeOpenedNowIsNotMissing) {
  if (__ubsan_handle_dynamic_type_cache_miss)
    GTEST_SKIP() << "the sanitizer opens pipes, which it may not here";
  cache_.Write(key_, Bytes(10));
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::open("/dev/null", O_RDONLY);
  ::close(next);
  const rlimit none_left{rlim_t(next), before.rlim_max};
  ::setrlimit(RLIMIT_NOFILE, &none_left);
  EXPECT_THROW(cache_.Read(key_), Unavailable);
  EXPECT_THROW(cache_.BytesDigest(key_), Unavailable);
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_TRUE(cache_.Read(key_));
}

// As the first versions stored all of them.
TEST_F(StageCacheTest, AnArtefactInOnePieceIsRead) {
  const std::string bytes = Bytes(kSeveralFrames);
  std::string packed(ZSTD_compressBound(bytes.size()), 0);
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  const Digest digest = Sha256(packed);
  std::filesystem::create_directories(FileOf(key_).parent_path());
  std::ofstream(FileOf(key_), std::ios::binary)
      << "KVA1" << std::string(digest.bytes.begin(), digest.bytes.end()) << packed;
  const auto back = cache_.Read(key_);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->view() == bytes);
}

// Headers that no bytes stand behind; the digest is right.
class ClaimedFrames : public StageCacheTest {
 protected:
  static std::string Frame(uint64_t claimed, const std::string& block) {
    const std::string size(reinterpret_cast<const char*>(&claimed), sizeof claimed);
    return "\x28\xb5\x2f\xfd\xe0" + size + block;
  }
  void ExpectDamage(const std::string& packed) {
    const Digest digest = Sha256(packed);
    std::filesystem::create_directories(FileOf(key_).parent_path());
    std::ofstream(FileOf(key_), std::ios::binary)
        << "KVA1" << std::string(reinterpret_cast<const char*>(digest.bytes.data()), 32) << packed;
    EXPECT_TRUE(cache_.Intact(key_));
    EXPECT_FALSE(cache_.Read(key_));
  }
  const std::string empty_block_ = std::string("\x01\0\0", 3);
};

// Four kilobytes together, by going round 2^64.
TEST_F(ClaimedFrames, ThatGoRoundAreDamage) {
  ExpectDamage(Frame(uint64_t(0) - 4096, empty_block_) + Frame(8192, empty_block_));
}

// More than any memory: asking for it would end the program instead of the artefact.
TEST_F(ClaimedFrames, ThatHoldMoreThanTheirBytesCanAreDamage) {
  ExpectDamage(Frame(uint64_t(1) << 62, empty_block_));
  ExpectDamage(Frame(4, "\x23" + std::string(2, 0) + "a") + Frame(uint64_t(1) << 62, empty_block_));
}

}  // namespace
}  // namespace kvx
