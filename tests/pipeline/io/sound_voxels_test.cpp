// Files that lost an end or a bit: refused, or read as if nothing had happened, never as something else.
#include "pipeline/io/sound_voxels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/deflated.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing_support::Deflated;
using testing_support::kGzip;
using testing_support::kZlib;
using testing_support::ScratchFolder;

const std::string kNrrd = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nspacings: 1 2 3\n";
const std::string kMeta =
    "ObjectType = Image\nNDims = 3\nElementSpacing = 1 2 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\n";
const std::string kHere = "ElementDataFile = LOCAL\n";

std::string Voxels(int count = 5 * 4 * 3) {
  std::string bytes;
  for (int n = 0; n < count; ++n) bytes += char(n * n % 101);
  return bytes;
}

std::string AsText(const std::string& voxels) {
  std::string text;
  for (const char voxel : voxels) text += std::to_string(int(voxel)) + " ";
  return text;
}

std::string PackedMeta(const std::string& stream) {
  return kMeta + "BinaryData = True\nCompressedData = True\n" + kHere + stream;
}

std::string SizedMeta(const std::string& stream, size_t size) {
  return kMeta + "BinaryData = True\nCompressedData = True\nCompressedDataSize = " + std::to_string(size) +
         "\n" + kHere + stream;
}

class SoundVoxels : public testing::Test {
 protected:
  std::string ComplaintOf(const std::string& bytes, const std::string& extension) {
    const std::filesystem::path file = folder_.path() / ("v" + extension);
    std::ofstream(file, std::ios::binary) << bytes;
    try {
      const std::vector<float> values = ReadScan(file).volume.values;
      const std::string voxels = Voxels();
      return values == std::vector<float>(voxels.begin(), voxels.end()) ? "none" : "other voxels";
    } catch (const InputError& error) {
      return error.what();
    }
  }
  // Whatever is missing at the end.
  void ExpectEveryCutRefused(const std::string& bytes, size_t header, const std::string& extension) {
    ASSERT_EQ(ComplaintOf(bytes, extension), "none");
    for (size_t length = header; length < bytes.size(); ++length) {
      const std::string complaint = ComplaintOf(bytes.substr(0, length), extension);
      EXPECT_TRUE(complaint.find("cut off") != std::string::npos) << extension << " " << length << complaint;
    }
  }
  // Some bits of a gzip header say nothing of the voxels.
  void ExpectNoBitMakesOtherVoxels(const std::string& bytes, size_t header, const std::string& extension) {
    int refused = 0;
    for (size_t bit = 8 * header; bit < 8 * bytes.size(); ++bit) {
      std::string flipped = bytes;
      flipped[bit / 8] = char(flipped[bit / 8] ^ (1 << bit % 8));
      const std::string complaint = ComplaintOf(flipped, extension);
      EXPECT_NE(complaint, "other voxels") << extension << " bit " << bit;
      refused += complaint != "none";
    }
    EXPECT_GT(refused, 8 * int(bytes.size() - header - 10));
  }

  ScratchFolder folder_;
};

// MET_LONG is four bytes, but some programs wrote eight: every other voxel would be 0.
TEST_F(SoundVoxels, RawOnesThatAreTwiceAsManyAreOfAnotherType) {
  const std::string meta = kMeta + "BinaryData = True\n" + kHere, nrrd = kNrrd + "encoding: raw\n";
  EXPECT_EQ(ComplaintOf(meta + Voxels() + "\n", ".mha"), "none");
  EXPECT_EQ(ComplaintOf(nrrd + "\n" + Voxels() + "an end", ".nrrd"), "none");
  EXPECT_THAT(ComplaintOf(meta + Voxels() + Voxels(), ".mha"), HasSubstr("twice as many"));
  EXPECT_THAT(ComplaintOf(nrrd + "\n" + Voxels() + Voxels(), ".nrrd"), HasSubstr("twice as many"));
  EXPECT_EQ(ComplaintOf(nrrd + "byte skip: -1\n\n" + Voxels() + Voxels(), ".nrrd"), "none")
      << "the last ones are meant";
}

TEST_F(SoundVoxels, SoAreThoseOfAFileBesideTheHeader) {
  const std::string meta = kMeta + "BinaryData = True\n", nrrd = kNrrd + "encoding: raw\ndata file: v.raw\n";
  const auto with = [&](const std::string& raw) { std::ofstream(folder_.path() / "v.raw") << raw; };
  with(Voxels() + "an end");
  EXPECT_EQ(ComplaintOf(meta + "ElementDataFile = v.raw\n", ".mhd"), "none");
  EXPECT_EQ(ComplaintOf(nrrd, ".nhdr"), "none");
  with(Voxels() + Voxels());
  EXPECT_THAT(ComplaintOf(meta + "ElementDataFile = v.raw\n", ".mhd"), HasSubstr("twice as many"));
  EXPECT_THAT(ComplaintOf(nrrd, ".nhdr"), HasSubstr("twice as many"));
  with(Voxels(20) + Voxels() + Voxels());
  EXPECT_EQ(ComplaintOf(meta + "HeaderSize = 20\nElementDataFile = v.raw\n", ".mhd"), "none")
      << "one of several that share the file";
  EXPECT_EQ(ComplaintOf(nrrd + "byte skip: 20\n", ".nhdr"), "none");
  EXPECT_EQ(ComplaintOf(nrrd + "byte skip: -1\n", ".nhdr"), "none") << "the last ones are meant";
}

TEST_F(SoundVoxels, NothingMayBeMissingAtTheEnd) {
  const std::string gzip = Deflated(Voxels(), kGzip), zlib = Deflated(Voxels(), kZlib);
  const auto check = [&](const std::string& bytes, const std::string& voxels, const char* extension) {
    ExpectEveryCutRefused(bytes, bytes.size() - voxels.size(), extension);
  };
  check(kNrrd + "encoding: gzip\n\n" + gzip, gzip, ".nrrd");
  check(PackedMeta(zlib), zlib, ".mha");
  check(SizedMeta(zlib, zlib.size()), zlib, ".mha");
  check(kMeta + kHere + Voxels(), Voxels(), ".mha");
  check(kNrrd + "encoding: raw\n\n" + Voxels(), Voxels(), ".nrrd");
}

TEST_F(SoundVoxels, TextHoldsANumberForEachVoxel) {
  const std::string header = kMeta + "BinaryData = False\n" + kHere;
  EXPECT_EQ(ComplaintOf(header + AsText(Voxels()), ".mha"), "none");
  EXPECT_THAT(ComplaintOf(header + AsText(Voxels(59)), ".mha"), HasSubstr("cut off"));
}

TEST_F(SoundVoxels, NoFlippedBitMakesOtherVoxels) {
  const std::string gzip = Deflated(Voxels(), kGzip), zlib = Deflated(Voxels(), kZlib);
  const std::string nrrd = kNrrd + "encoding: gzip\n\n" + gzip;
  ExpectNoBitMakesOtherVoxels(nrrd, nrrd.size() - gzip.size(), ".nrrd");
  const std::string meta = PackedMeta(zlib);
  ExpectNoBitMakesOtherVoxels(meta, meta.size() - zlib.size(), ".mha");
}

TEST_F(SoundVoxels, PackedVoxelsAreAsManyAsTheHeaderSays) {
  for (const int count : {59, 61}) {
    const std::string expected = count < 60 ? "cut off" : "not as many";
    EXPECT_THAT(ComplaintOf(kNrrd + "encoding: gzip\n\n" + Deflated(Voxels(count), kGzip), ".nrrd"),
                HasSubstr(expected));
    EXPECT_THAT(ComplaintOf(PackedMeta(Deflated(Voxels(count), kZlib)), ".mha"), HasSubstr(expected));
  }
  const std::string zlib = Deflated(Voxels(), kZlib);
  EXPECT_THAT(ComplaintOf(SizedMeta(zlib, zlib.size() - 1), ".mha"), HasSubstr("cut off"));
}

TEST_F(SoundVoxels, AGzipFileMayBeOfSeveralStreams) {
  const std::string all = Voxels();
  const std::string nrrd =
      kNrrd + "encoding: gzip\n\n" + Deflated(all.substr(0, 25), kGzip) + Deflated(all.substr(25), kGzip);
  EXPECT_EQ(ComplaintOf(nrrd, ".nrrd"), "none");
}

TEST_F(SoundVoxels, LongStreamsAreCheckedInParts) {
  const ScratchFolder folder;
  std::string voxels(100 * 100 * 100, '\0');
  uint32_t random = 1;
  for (char& voxel : voxels) voxel = char((random = random * 1664525 + 1013904223) >> 28);
  const std::string header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 100 100 100\nencoding: gzip\n\n";
  std::string bytes = header + Deflated(voxels, kGzip);
  const auto file = folder.path() / "v.nrrd";
  const auto check = [&] {
    std::ofstream(file, std::ios::binary) << bytes;
    RequireSoundVoxels(ReadTextHeader(FileFormat::kNrrd, file), voxels.size(), voxels.size());
  };
  EXPECT_NO_THROW(check());
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
  EXPECT_THROW(check(), InputError);
}

}  // namespace
}  // namespace kvx
