// Content codings, read back by their own libraries.
#include "storage/files/content_encoding.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <random>
#include <string>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

TEST(ContentEncoding, TheClientsWishDecides) {
  EXPECT_EQ(BestEncoding(""), Encoding::kIdentity);
  EXPECT_EQ(BestEncoding("br, deflate"), Encoding::kIdentity);
  EXPECT_EQ(BestEncoding("gzip, deflate, br"), Encoding::kGzip);
  EXPECT_EQ(BestEncoding("gzip, zstd"), Encoding::kZstd);
  EXPECT_EQ(BestEncoding("gzip;q=1.0, zstd;q=0.5"), Encoding::kGzip);
  EXPECT_EQ(BestEncoding("gzip;q=0, identity"), Encoding::kIdentity);
  EXPECT_EQ(BestEncoding("*"), Encoding::kZstd);
  EXPECT_EQ(BestEncoding("zstd;q=0, *;q=0.1"), Encoding::kGzip);
}

// What a coded file of such a start holds behind it.
std::string Unpacked(const std::string& coded, size_t start, Encoding encoding, size_t plain_bytes) {
  std::string plain(plain_bytes + 1, '\0');
  size_t got = 0;
  if (encoding == Encoding::kIdentity) return coded.substr(start);
  if (encoding == Encoding::kZstd) {
    got = ZSTD_decompress(plain.data(), plain.size(), coded.data() + start, coded.size() - start);
    EXPECT_FALSE(ZSTD_isError(got)) << ZSTD_getErrorName(got);
    if (ZSTD_isError(got)) return {};
  } else {
    z_stream stream{};
    EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(coded.data() + start));
    stream.avail_in = uInt(coded.size() - start);
    stream.next_out = reinterpret_cast<Bytef*>(plain.data());
    stream.avail_out = uInt(plain.size());
    EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
    got = stream.total_out;
    inflateEnd(&stream);
  }
  return plain.substr(0, got);
}

TEST(ContentEncoding, CodedFilesKeepTheirPlainStartAndUnpack) {
  const ScratchFolder scratch;
  std::string text = "HEAD";
  while (text.size() < 3'000'000) text += "line " + std::to_string(text.size() % 977) + "\n";
  const CachedFile from(text);
  for (const Encoding encoding : {Encoding::kGzip, Encoding::kZstd, Encoding::kIdentity}) {
    const auto path = scratch.path() / "coded";
    WriteEncoded(from, 4, encoding, path);
    const std::string coded = testing_support::Content(path);
    ASSERT_EQ(coded.substr(0, 4), "HEAD");
    EXPECT_EQ(Unpacked(coded, 4, encoding, text.size()), text.substr(4));
    if (encoding != Encoding::kIdentity) {
      EXPECT_LT(coded.size(), text.size() / 3);
    }
  }
  WriteEncoded(CachedFile(std::string("HEAD")), 4, Encoding::kZstd, scratch.path() / "empty");
  EXPECT_GT(CachedFile(scratch.path() / "empty").size(), 4u) << "nothing, coded, is still a frame";
}

// The last piece of what cannot be packed fills a coder's buffer several times.
TEST(ContentEncoding, WhatCannotBePackedIsWholeToo) {
  const ScratchFolder scratch;
  std::mt19937 random(5);
  std::string noise;
  while (noise.size() < 2'500'000) noise += char(random());
  for (const Encoding encoding : {Encoding::kGzip, Encoding::kZstd}) {
    const auto path = scratch.path() / "coded";
    WriteEncoded(CachedFile(noise), 0, encoding, path);
    EXPECT_TRUE(Unpacked(testing_support::Content(path), 0, encoding, noise.size()) == noise)
        << NameOf(encoding);
  }
}

}  // namespace
}  // namespace kvx
