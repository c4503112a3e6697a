// What ITK is given instead of a file's own header; then files of every packing, read through it, and headers
// that try to reach another file.
#include "pipeline/io/standard_header.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/deflated.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::Deflated;
using testing_support::kGzip;
using testing_support::kZlib;
using testing_support::ScratchFolder;

constexpr int kCount = 4 * 3 * 2;

void Put(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string Bytes(int first) {
  std::string bytes;
  for (int n = 0; n < kCount; ++n) bytes += char(first + n);
  return bytes;
}

std::vector<float> Expected() {
  std::vector<float> values(kCount);
  for (int n = 0; n < kCount; ++n) values[size_t(n)] = float(1 + n);
  return values;
}

const std::string kUnplaced = "NRRD0004\n# made by hand\ntype: unsigned char\ndimension: 3\nsizes: 4 3 2\n";
const std::string kNrrd = kUnplaced + "spacings: 1 2 3\n";
const std::string kMeta =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 1 2 3\nDimSize = 4 3 2\n"
    "ElementType = MET_UCHAR\n";

TEST(StandardHeader, KeepsWhatMattersInWordsOfItsOwn) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "a.nrrd";
  const std::string header = kUnplaced +
                             "content: a name\nEncoding: raw\nspace: left-posterior-superior\n"
                             "space directions: (1,0,0) (0,2,0) (0,0,3)\nnote:=x: y\n\n";
  Put(file, header + Bytes(1));
  EXPECT_EQ(StandardHeaderText(ReadTextHeader(FileFormat::kNrrd, file), "voxels"),
            "NRRD0005\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\n"
            "space directions: (1,0,0) (0,2,0) (0,0,3)\nencoding: raw\nline skip: 11\ndata file: voxels\n");
  const std::filesystem::path meta = folder.path() / "a.mha";
  Put(meta, kMeta + "Comment = a name\nElementDataFile = LOCAL\n" + Bytes(1));
  EXPECT_EQ(StandardHeaderText(ReadTextHeader(FileFormat::kMeta, meta), "voxels"),
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 1 2 3\nDimSize = 4 3 2\n"
            "ElementType = MET_UCHAR\nHeaderSize = " +
                std::to_string(kMeta.size() + 41) + "\nElementDataFile = voxels\n");
}

TEST(StandardHeader, EveryPackingIsReadThroughIt) {
  const ScratchFolder folder;
  std::string text;
  for (const float value : Expected()) text += std::to_string(int(value)) + " ";
  const std::string gz = Deflated(Bytes(1), kGzip), zlib = Deflated(Bytes(1), kZlib);
  const std::vector<std::pair<std::string, std::string>> files{
      {"raw.nrrd", kNrrd + "encoding: raw\n\n" + Bytes(1)},
      {"crlf.nrrd",
       "NRRD0004\r\ntype: uchar\r\ndimension: 3\r\nsizes: 4 3 2\r\nspacings: 1 2 3\r\nencoding: raw\r\n\r\n" +
           Bytes(1)},
      {"gz.nrrd", kNrrd + "encoding: gzip\n\n" + gz},
      {"text.nrrd", kNrrd + "encoding: ascii\n\n" + text},
      {"skip.nrrd", kNrrd + "line skip: 1\nencoding: raw\n\nanother line\n" + Bytes(1)},
      {"gzskip.nrrd", kNrrd + "byte skip: 3\nencoding: gzip\n\n" + Deflated("abc" + Bytes(1), kGzip)},
      {"away.nhdr", kNrrd + "encoding: raw\ndata file: raw.bin"},
      {"skipped.nhdr", kNrrd + "encoding: raw\nbyte skip: 5\ndata file: late.bin\n"},
      {"end.nhdr", kNrrd + "encoding: raw\nbyte skip: -1\ndata file: late.bin\n"},
      {"gz.nhdr", kNrrd + "encoding: gz\ndatafile: gz.bin\n"},
      {"raw.mha", kMeta + "ElementDataFile = LOCAL\n" + Bytes(1)},
      {"zlib.mha", kMeta + "CompressedData = True\nCompressedDataSize = " + std::to_string(zlib.size()) +
                       "\nElementDataFile = LOCAL\n" + zlib},
      {"unsized.mha", kMeta + "CompressedData = True\nElementDataFile = LOCAL\n" + zlib},
      {"away.mhd", kMeta + "ElementDataFile = raw.bin"},
      {"skipped.mhd", kMeta + "HeaderSize = 5\nElementDataFile = late.bin\n"},
      {"end.mhd", kMeta + "HeaderSize = -1\nElementDataFile = late.bin\n"},
  };
  Put(folder.path() / "raw.bin", Bytes(1));
  Put(folder.path() / "late.bin", "12345" + Bytes(1));
  Put(folder.path() / "gz.bin", gz);
  for (const auto& [name, bytes] : files) {
    Put(folder.path() / name, bytes);
    try {
      EXPECT_EQ(ReadScan(folder.path() / name).volume.values, Expected()) << name;
    } catch (const Error& error) {
      ADD_FAILURE() << name << ": " << error.what();
    }
  }
}

// Voxels of 22 um are not 22 mm wide.
TEST(StandardHeader, LengthsAreInMillimetresWhateverTheFileHasThemIn) {
  const ScratchFolder folder;
  const std::string lps =
      "space: left-posterior-superior\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n"
      "space origin: (50,60,70)\n";
  const auto grid_of = [&](const std::string& name, const std::string& bytes) {
    Put(folder.path() / name, bytes);
    return ReadVolumeInfo(folder.path() / name).grid;
  };
  const auto nrrd = [&](const std::string& units) {
    return grid_of("a.nrrd", kUnplaced + "encoding: raw\n" + lps + units + "\n" + Bytes(1));
  };
  for (const auto& [units, mm] : {std::pair("", 1.0), std::pair("space units: \"mm\" \"mm\" \"mm\"\n", 1.0),
                                  std::pair("space units: \"um\" \"um\" \"um\"\n", 0.001),
                                  std::pair("space units: \"cm\" \"cm\" \"\"\n", 10.0)}) {
    if (mm < 0.01) {
      EXPECT_THROW(nrrd(units), InputError) << "a hundredth of a millimetre in all";
      continue;
    }
    EXPECT_TRUE(nrrd(units).spacing_mm.isApprox(mm * Eigen::Vector3d(1, 2, 3))) << units;
    EXPECT_TRUE(nrrd(units).origin.lps.isApprox(mm * Eigen::Vector3d(50, 60, 70))) << units;
  }
  EXPECT_THROW(nrrd("space units: \"mm\" \"um\" \"mm\"\n"), InputError);
  EXPECT_THROW(nrrd("space units: \"furlong\" \"furlong\" \"furlong\"\n"), InputError);
  const std::string here = "ElementDataFile = LOCAL\n" + Bytes(1);
  EXPECT_TRUE(grid_of("a.mha", kMeta + "DistanceUnits = cm\n" + here)
                  .spacing_mm.isApprox(Eigen::Vector3d(10, 20, 30)));
  EXPECT_TRUE(
      grid_of("a.mha", kMeta + "DistanceUnits = ?\n" + here).spacing_mm.isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(StandardHeader, VoxelsOfAMetaImageAreRescaledAsItSays) {
  const ScratchFolder folder;
  const auto file = folder.path() / "a.mha";
  const auto with = [&](const std::string& slope, const std::string& offset) {
    Put(file, kMeta + "ElementToIntensityFunctionSlope = " + slope + "\nElementToIntensityFunctionOffset = " +
                  offset + "\nElementDataFile = LOCAL\n" + Bytes(1));
    return ReadScan(file);
  };
  EXPECT_EQ(with("1", "0").volume.values, Expected());
  EXPECT_EQ(with("1", "0").stored_as, ScalarType::kUint8);
  const Scan scan = with("2", "-1024");
  for (size_t v = 0; v < scan.volume.values.size(); ++v)
    ASSERT_EQ(scan.volume.values[v], 2 * Expected()[v] - 1024);
  EXPECT_EQ(scan.stored_as, ScalarType::kInt16);
  EXPECT_EQ(ReadVolumeInfo(file).stored_as, ScalarType::kInt16);
  EXPECT_THROW(with("0", "0"), InputError);
  EXPECT_THROW(with("nan", "0"), InputError);
}

// Whoever sends a volume must not get another file's bytes back as its voxels.
TEST(StandardHeader, NoHeaderReachesAnotherFile) {
  const ScratchFolder folder;
  const std::filesystem::path canary = folder.path() / "elsewhere" / "canary";
  std::filesystem::create_directory(canary.parent_path());
  Put(canary, Bytes(101));
  std::string comments, hashes;
  for (int n = 0; n < 10001; ++n) comments += "Comment = x\n", hashes += "# x\n";
  const std::string there = "ElementDataFile = " + canary.string() + "\n", here = "ElementDataFile = LOCAL\n";
  const std::string away = "data file: " + canary.string() + "\n", raw = "encoding: raw\n";
  const std::vector<std::string> meta{
      kMeta + there,
      kMeta + "elementdatafile = LOCAL\n" + there,
      kMeta + "ElementDataFile: " + canary.string() + "\n",
      kMeta + "\n" + there,
      kMeta + comments + there,
      kMeta + "Comment = x\r" + there + here,
      kMeta + "Comment = " + std::string(5000, 'x') + there + here,
      kMeta + "Comment = " + std::string(255, 'x') + there + here,
      kMeta + "HeaderSize = 0 " + there + here,
      kMeta + "Offset = 0 0 0 " + there + here,
      kMeta + "Comment = x" + std::string(1, '\0') + "\n" + there + here,
  };
  const std::vector<std::string> nrrd{
      kNrrd + raw + away + "\n",
      kNrrd + raw + "Data File: " + canary.string() + "\n\n",
      kNrrd + raw + "datafile:" + canary.string() + "\n\n",
      kNrrd + raw + hashes + away + "\n",
      kNrrd + raw + " \n" + away + "\n",
      kNrrd + raw + "content: x\r" + away + "\n",
      kNrrd + "encoding: raw\r" + away + "\n",
      kNrrd + raw + "data file:=x\n" + away + "\n",
      kNrrd + raw + "content: x" + std::string(1, '\0') + "\n" + away + "\n",
  };
  int read = 0;
  const auto try_each = [&](const std::vector<std::string>& headers, const std::string& extension) {
    for (size_t n = 0; n < headers.size(); ++n) {
      const auto file = folder.path() / (std::to_string(n) + extension);
      Put(file, headers[n] + Bytes(1));
      try {
        EXPECT_LT(ReadScan(file).volume.values[0], 100) << file.filename();
        ++read;
      } catch (const InputError&) {
      }
    }
  };
  for (const char* extension : {".mha", ".mhd"}) try_each(meta, extension);
  for (const char* extension : {".nrrd", ".nhdr"}) try_each(nrrd, extension);
  EXPECT_LT(read, 20) << "most are refused; those that only look odd are read as what they hold";
}

}  // namespace
}  // namespace kvx
