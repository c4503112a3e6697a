// Headers broken one field at a time, and files that others made to break readers: read properly or refused,
// never worse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <new>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/deflated.h"
#include "tests/support/fixtures.h"
#include "tests/support/scarce_memory.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

void Put(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string Complaint(const std::filesystem::path& path) {
  try {
    ReadScan(path);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), Not(HasSubstr(path.parent_path().filename().string())))
        << "a message holds a path";
    return error.what();
  }
  return "none";
}

class BadNifti : public testing::Test {
 protected:
  BadNifti() {
    WriteVolume(folder_.path() / "good.nii", LinearRamp{}.On(ObliqueGrid()), ScalarType::kInt16);
    bytes_ = Content(folder_.path() / "good.nii");
  }
  template <class T>
  void Set(size_t offset, T value) {
    std::memcpy(bytes_.data() + offset, &value, sizeof value);
  }
  void Add(size_t offset, float more) {
    float value = 0;
    std::memcpy(&value, bytes_.data() + offset, sizeof value);
    Set<float>(offset, value + more);
  }
  std::string ComplaintNow() {
    Put(folder_.path() / "v.nii", bytes_);
    return Complaint(folder_.path() / "v.nii");
  }

  ScratchFolder folder_;
  std::string bytes_;
};

TEST_F(BadNifti, OneBrokenFieldAtATime) {
  const std::string good = bytes_;
  struct Case {
    const char* what;
    std::function<void()> harm;
    const char* complaint;
  };
  const float nan = std::nanf("");
  const Case cases[] = {
      {"nothing", [] {}, "none"},
      {"size field", [&] { Set<int32_t>(0, 7); }, "not a readable NIfTI"},
      {"magic", [&] { Set<int32_t>(344, 0); }, "Analyze"},
      {"half a pair", [&] { std::memcpy(&bytes_[344], "ni1", 4); }, "one half of a NIfTI pair"},
      {"2-D", [&] { Set<int16_t>(40, 2); }, "2-D"},
      {"no dimensions", [&] { Set<int16_t>(40, 0); }, "header is damaged"},
      {"many dimensions", [&] { Set<int16_t>(40, 900); }, "header is damaged"},
      {"negative size", [&] { Set<int16_t>(42, -17); }, "size that is not positive"},
      {"zero size", [&] { Set<int16_t>(44, 0); }, "size that is not positive"},
      {"one slice", [&] { Set<int16_t>(46, 1); }, "single slice"},
      {"far too large",
       [&] {
         for (int d = 0; d < 3; ++d) Set<int16_t>(42 + 2 * d, 32767);
       },
       "more than 2147483647 voxels"},
      {"larger than the file", [&] { Set<int16_t>(46, 3000); }, "too short"},
      {"frames", [&] { Set<int16_t>(40, 4), Set<int16_t>(48, 5); }, "5 frames"},
      {"vectors", [&] { Set<int16_t>(40, 5), Set<int16_t>(48, 1), Set<int16_t>(50, 3); },
       "several values per voxel"},
      {"one frame", [&] { Set<int16_t>(40, 4), Set<int16_t>(48, 1); }, "none"},
      {"colours", [&] { Set<int16_t>(70, 128); }, "colours"},
      {"complex", [&] { Set<int16_t>(70, 32); }, "complex"},
      {"unknown type", [&] { Set<int16_t>(70, 999); }, "voxel type"},
      {"offset before the end of the header", [&] { Set<float>(108, 10); }, "header is damaged"},
      {"offset beyond the file", [&] { Set<float>(108, 9e8f); }, "too short"},
      {"offset not a number", [&] { Set<float>(108, nan); }, "header is damaged"},
      {"no forms, zero spacing", [&] { Set<int32_t>(252, 0), Set<float>(80, 0); }, "voxel spacing"},
      {"no forms, spacing not a number", [&] { Set<int32_t>(252, 0), Set<float>(88, nan); }, "voxel spacing"},
      {"qform alone, spacing not a number", [&] { Set<int32_t>(252, 1), Set<float>(84, nan); },
       "voxel spacing"},
      {"no forms, negative spacing", [&] { Set<int32_t>(252, 0), Set<float>(84, -1); }, "voxel spacing"},
      {"no forms, spacing in metres",
       [&] {
         Set<int32_t>(252, 0);
         for (int d = 0; d < 3; ++d) Set<float>(80 + 4 * d, 0.002f);
       },
       "smaller than a millimetre"},
      {"no forms, thinner than any scanner's", [&] { Set<int32_t>(252, 0), Set<float>(88, 0.001f); },
       "x 0.001 mm, and no scan of bones"},
      {"no forms, wider than bones", [&] { Set<int32_t>(252, 0), Set<float>(84, 51); }, "x 51 x "},
      {"no forms, longer than any scanner", [&] { Set<int32_t>(252, 0), Set<float>(80, 300); },
       "longer than three metres"},
      {"beyond all measure", [&] { Set<float>(292, 3e38f); }, "a kilometre away"},
      {"sform not a number", [&] { Set<float>(280, nan); }, "header is damaged"},
      {"sform flat",
       [&] {
         for (int r = 0; r < 3; ++r) Set<float>(280 + 16 * r, 0);
       },
       "voxel spacing"},
      {"sform sheared", [&] { Set<float>(284, 2); }, "sheared"},
      // of 13 voxels, so that the last lies this many times 12 off the qform, which is a tenth of a voxel at
      // most
      {"sform sheared by voxels", [&] { Add(284, 0.15f); }, "sheared"},
      {"sform sheared by rounding", [&] { Add(284, 0.003f); }, "none"},
      {"qform not a rotation", [&] { Set<int16_t>(254, 0), Set<float>(256, 4); }, "header is damaged"},
  };
  for (const Case& c : cases) {
    bytes_ = good;
    c.harm();
    EXPECT_THAT(ComplaintNow(), HasSubstr(c.complaint)) << c.what;
  }
}

TEST_F(BadNifti, CutOffAnywhere) {
  const std::string good = bytes_;
  for (const size_t length : {0, 3, 200, 348, 351, 352, 1000, 4000}) {
    bytes_ = good.substr(0, length);
    EXPECT_NE(ComplaintNow(), "none") << length;
  }
  WriteVolume(folder_.path() / "good.nii.gz", LinearRamp{}.On(ObliqueGrid()), ScalarType::kInt16);
  const std::string packed = Content(folder_.path() / "good.nii.gz");
  for (size_t length = 0; length < packed.size(); length += packed.size() / 17) {
    Put(folder_.path() / "v.nii.gz", packed.substr(0, length));
    EXPECT_NE(Complaint(folder_.path() / "v.nii.gz"), "none") << length;
  }
  std::string flipped = packed;
  flipped[flipped.size() - 6] ^= 1;  // in the checksum
  Put(folder_.path() / "v.nii.gz", flipped);
  EXPECT_THAT(Complaint(folder_.path() / "v.nii.gz"), HasSubstr("damaged"));
}

TEST_F(BadNifti, TwiceTheVoxelsAreSeveralFramesOrOfAnotherType) {
  const std::string good = bytes_;
  bytes_ = good + "an end";
  EXPECT_EQ(ComplaintNow(), "none");
  bytes_ = good + good.substr(352);
  EXPECT_THAT(ComplaintNow(), HasSubstr("twice as many"));
  Put(folder_.path() / "v.nii.gz", Deflated(bytes_, kGzip));
  EXPECT_THAT(Complaint(folder_.path() / "v.nii.gz"), HasSubstr("twice as many"));
}

TEST_F(BadNifti, QformAloneAndSpacingAloneArePlacesToo) {
  Set<int16_t>(254, 0);
  EXPECT_EQ(ComplaintNow(), "none");
  const Grid from_qform = ReadScan(folder_.path() / "v.nii").volume.grid;
  EXPECT_LT((from_qform.MmFromVox() - ObliqueGrid().MmFromVox()).norm(), 1e-5);
  EXPECT_LT((from_qform.origin.lps - ObliqueGrid().origin.lps).norm(), 1e-5);
  Set<int16_t>(252, 0);
  EXPECT_EQ(ComplaintNow(), "none");
  const Grid bare = ReadScan(folder_.path() / "v.nii").volume.grid;
  EXPECT_TRUE(
      bare.direction.isApprox(Eigen::Vector3d(-1, -1, 1).asDiagonal().toDenseMatrix()));  // RAS axes in LPS
  EXPECT_TRUE(bare.spacing_mm.isApprox(ObliqueGrid().spacing_mm, 1e-6));
}

// A quarter turn about z, voxels of 1, 2 and 4 mm, the third axis the other way (qfac), at 10, 20, 30 in RAS:
// the axes are (0, 1, 0), (-1, 0, 0), (0, 0, -1) in RAS.
TEST_F(BadNifti, AQformMayTurnTheThirdAxisRound) {
  const float half = std::sqrt(0.5f), quatern[3] = {0, 0, half}, offset[3] = {10, 20, 30};
  const float pixdim[4] = {-1, 1, 2, 4};
  Set<int16_t>(252, 1), Set<int16_t>(254, 0);
  for (int a = 0; a < 3; ++a) Set<float>(256 + 4 * a, quatern[a]), Set<float>(268 + 4 * a, offset[a]);
  for (int d = 0; d < 4; ++d) Set<float>(76 + 4 * d, pixdim[d]);
  ASSERT_EQ(ComplaintNow(), "none");
  const Grid grid = ReadScan(folder_.path() / "v.nii").volume.grid;
  const Eigen::Vector3d corner(-10, -20, 30);
  EXPECT_LT((grid.ToMm(0, 0, 0).lps - corner).norm(), 1e-5);
  EXPECT_LT((grid.ToMm(1, 0, 0).lps - (corner + Eigen::Vector3d(0, -1, 0))).norm(), 1e-5);
  EXPECT_LT((grid.ToMm(0, 1, 0).lps - (corner + Eigen::Vector3d(2, 0, 0))).norm(), 1e-5);
  EXPECT_LT((grid.ToMm(0, 0, 1).lps - (corner + Eigen::Vector3d(0, 0, -4))).norm(), 1e-5);
}

TEST_F(BadNifti, MetresAndMicrometresArePlacesToo) {
  const std::string good = bytes_;
  struct Unit {
    uint8_t code;
    float per_mm;
  };
  for (const Unit& unit : {Unit{1, 0.001f}, Unit{2, 1}, Unit{3, 1000}, Unit{3 | 8, 1000}}) {  // 8: seconds
    bytes_ = good;
    Set<uint8_t>(123, unit.code);
    for (size_t at = 280; at < 328; at += 4) {
      float mm;
      std::memcpy(&mm, &good[at], sizeof mm);
      Set<float>(at, mm * unit.per_mm);
    }
    ASSERT_EQ(ComplaintNow(), "none") << int(unit.code);
    const Grid grid = ReadScan(folder_.path() / "v.nii").volume.grid;
    EXPECT_LT((grid.MmFromVox() - ObliqueGrid().MmFromVox()).norm(), 1e-4) << int(unit.code);
    EXPECT_LT((grid.origin.lps - ObliqueGrid().origin.lps).norm(), 1e-4) << int(unit.code);
  }
}

TEST_F(BadNifti, SlopeAndInterceptAreApplied) {
  const Volume stored = ReadScan(folder_.path() / "good.nii").volume;
  Set<float>(112, 2), Set<float>(116, -1024);
  ASSERT_EQ(ComplaintNow(), "none");
  const Scan whole = ReadScan(folder_.path() / "v.nii");
  EXPECT_EQ(whole.stored_as, ScalarType::kInt32) << "twice an int16 does not fit in one";
  for (size_t v = 0; v < 100; ++v) ASSERT_EQ(whole.volume.values[v], 2 * stored.values[v] - 1024);
  Set<float>(112, 0.5f);
  ASSERT_EQ(ComplaintNow(), "none");
  EXPECT_EQ(ReadScan(folder_.path() / "v.nii").stored_as, ScalarType::kFloat32);
  Set<float>(112, 0);  // "do not scale"
  ASSERT_EQ(ComplaintNow(), "none");
  EXPECT_EQ(ReadScan(folder_.path() / "v.nii").volume.values, stored.values);
}

TEST(BadTextHeaders, AreRefusedWithoutBelievingThem) {
  const ScratchFolder folder;
  const std::string nrrd =
      "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 4 4\nspacings: 1 1 1\nencoding: raw\nendian: little\n";
  const std::string meta =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 1 1 1\nElementType = MET_SHORT\n";
  const std::string data(128, '\1');
  struct Case {
    const char* name;
    std::string bytes;
    const char* complaint;
  };
  const std::vector<Case> cases{
      {"good.nrrd", nrrd + "\n" + data, "none"},
      {"cut.nrrd", nrrd + "\n" + data.substr(0, 20), "too short"},
      {"huge.nrrd",
       std::string(nrrd).replace(nrrd.find("sizes: 4 4 4"), 12, "sizes: 900 900 900") + "\n" + data,
       "too short"},
      {"bzip2.nrrd",
       std::string(nrrd).replace(nrrd.find("encoding: raw"), 13, "encoding: bzip2") + "\n" + data, "bzip2"},
      {"zero.nrrd",
       "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 0 4\nencoding: raw\nendian: little\n\n" + data,
       "not positive"},
      {"away.nhdr", nrrd + "data file: /etc/hostname\n", "another folder"},
      {"gone.nhdr", nrrd + "data file: gone.raw\n", "does not lie beside it"},
      {"list.nhdr", nrrd + "data file: s%02d.raw 1 4 1\n", "many files"},
      {"good.mha", meta + "DimSize = 4 4 4\nElementDataFile = LOCAL\n" + data, "none"},
      {"huge.mha", meta + "DimSize = 1000 1000 1000\nElementDataFile = LOCAL\n" + data, "too short"},
      {"negative.mha", meta + "DimSize = 4 -4 4\nElementDataFile = LOCAL\n" + data, "not positive"},
      {"dims.mha", "ObjectType = Image\nNDims = 5000\nDimSize = 4 4 4\nElementDataFile = LOCAL\n" + data,
       "header is damaged"},
      {"away.mhd", meta + "DimSize = 4 4 4\nElementDataFile = ../x.raw\n", "another folder"},
      {"empty.mha", "", "header is damaged"},
      {"empty.nrrd", "", "header is damaged"},
      {"what.tif", "II*", "extension"},
  };
  for (const Case& c : cases) {
    Put(folder.path() / c.name, c.bytes);
    EXPECT_THAT(Complaint(folder.path() / c.name), HasSubstr(c.complaint)) << c.name;
  }
  EXPECT_THAT(Complaint(folder.path() / "none.nii"), HasSubstr("does not exist"));
}

TEST(SoundVolumes, WantOfMemoryIsNotTheirFault) {
  if (!KVX_MEMORY_CAN_BE_SCARCE) GTEST_SKIP();
  const ScratchFolder scratch;
  const auto path = scratch.path() / "large.nrrd";
  WriteVolume(path, Volume(Grid{.size = {256, 256, 128}}), ScalarType::kUint8);
  const auto read = [&] {
    GetNoMoreMemoryThan(4 << 20);  // half of what its voxels take
    try {
      ReadScan(path);
    } catch (const std::bad_alloc&) {
      std::exit(2);
    }
    std::exit(0);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(read(), testing::ExitedWithCode(2), "");
}

TEST(MalformedVolumes, EachIsReadProperlyOrRefused) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  struct Case {
    const char* file;
    bool readable;
  };
  const Case cases[] = {
      {"nibabel/anatomical.nii", true},
      {"nibabel/standard.nii.gz", true},
      {"nibabel/reoriented_anat_moved.nii", true},
      {"nibabel/resampled_anat_moved.nii", true},
      {"nibabel/functional.nii", false},
      {"nibabel/example4d.nii.gz", false},
      {"nibabel/example_nifti2.nii.gz", false},
      {"nibabel/row_major.dconn.nii", false},
      {"nibabel/0.dcm", false},
      {"nibabel/T1.PAR", false},
      {"nibabel/test.mgz", false},
      {"nibabel/analyze.hdr", false},
      {"pynrrd/BallBinary30x30x30.nrrd", true},
      {"pynrrd/BallBinary30x30x30_gz.nrrd", true},
      {"pynrrd/BallBinary30x30x30.nhdr", true},
      {"pynrrd/BallBinary30x30x30.nii.gz", true},
      {"pynrrd/BallBinary30x30x30_byteskip_minus_five.nhdr", false},
      {"pynrrd/BallBinary30x30x30_bz2.nrrd", false},
      {"pynrrd/test1d_ascii.nrrd", false},
      {"pynrrd/test2d_ascii.nrrd", false},
      {"pynrrd/test_customFields.nrrd", false},
      {"pynrrd/test_simple4d_raw.nrrd", false},
  };
  for (const Case& c : cases) {
    const auto path = SharedData() / "malformed-volumes" / c.file;
    EXPECT_EQ(Complaint(path) == "none", c.readable) << c.file << ": " << Complaint(path);
  }
  EXPECT_EQ(ReadScan(SharedData() / "malformed-volumes/pynrrd/BallBinary30x30x30.nrrd").volume.values,
            ReadScan(SharedData() / "malformed-volumes/pynrrd/BallBinary30x30x30.nii.gz").volume.values);
}

}  // namespace
}  // namespace kvx
