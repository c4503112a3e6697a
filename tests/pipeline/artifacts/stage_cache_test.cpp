// What is stored comes back to the byte, of any size; damage anywhere in it is noticed.
#include "pipeline/artifacts/stage_cache.h"

#include <gtest/gtest.h>
#include <zstd.h>

#include <fstream>
#include <random>

#include "tests/support/fixtures.h"

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

}  // namespace
}  // namespace kvx
