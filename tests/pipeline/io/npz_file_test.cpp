// Arrays written and read back, arrays that NumPy wrote, and damaged files.
#include "pipeline/io/npz_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::ElementsAre;

// Letters of four bytes each, of which ASCII fills the first; NumPy pads with zeros.
std::vector<std::string> AsStrings(const NpyArray& array) {
  const size_t width = array.bytes.size() / array.Count();
  std::vector<std::string> values(array.Count());
  for (size_t v = 0; v < values.size(); ++v) {
    for (size_t c = 0; c < width; c += 4) {
      const char letter = array.bytes[v * width + c];
      if (letter != '\0') values[v] += letter;
    }
  }
  return values;
}

TEST(NpzFile, ArraysOfEveryKindComeBack) {
  const ScratchFolder folder;
  const std::vector<double> doubles{0.5, -2, 1e300, 0, 3, 4};
  const std::vector<int16_t> shorts{-32768, 7};
  const std::vector<uint8_t> flags{0, 9, 1};
  WriteNpz(folder.path() / "a.npz", {{"points", MakeNpy<double>({2, 3}, doubles)},
                                     {"shorts", MakeNpy<int16_t>({2}, shorts)},
                                     {"flags", MakeBoolNpy({3}, flags)},
                                     {"names", MakeStringNpy({"air", "", "muscle"})}});
  const NpyArrays read = ReadNpz(folder.path() / "a.npz");
  EXPECT_EQ(read.size(), 4u);
  EXPECT_THAT(ArrayNamed(read, "points").shape, ElementsAre(2, 3));
  EXPECT_EQ(AsDoubles(ArrayNamed(read, "points")), doubles);
  EXPECT_THAT(AsDoubles(ArrayNamed(read, "shorts")), ElementsAre(-32768, 7));
  EXPECT_EQ(ArrayNamed(read, "flags").dtype, "|b1");
  EXPECT_THAT(AsDoubles(ArrayNamed(read, "flags")), ElementsAre(0, 1, 1));
  EXPECT_EQ(ArrayNamed(read, "names").dtype, "<U6");
  EXPECT_THAT(AsStrings(ArrayNamed(read, "names")), ElementsAre("air", "", "muscle"));
  EXPECT_THROW(ArrayNamed(read, "absent"), InputError);
  EXPECT_THROW(AsDoubles(ArrayNamed(read, "names")), InputError);
}

TEST(NpzFile, TheSameArraysGiveTheSameBytes) {
  const ScratchFolder folder;
  const std::vector<float> values(1000, 1.5f);
  const auto bytes = [&](const char* name) {
    WriteNpz(folder.path() / name, {{"v", MakeNpy<float>({10, 100}, values)}});
    return Content(folder.path() / name);
  };
  const std::string first = bytes("a.npz");
  EXPECT_EQ(first, bytes("b.npz"));
  EXPECT_LT(first.size(), 1000u) << "not deflated";
}

TEST(NpzFile, ADamagedFileIsRefused) {
  const ScratchFolder folder;
  const auto path = folder.path() / "a.npz";
  std::vector<int32_t> values(5000);
  for (size_t v = 0; v < values.size(); ++v) values[v] = int32_t(v * 2654435761u);
  WriteNpz(path, {{"v", MakeNpy<int32_t>({5000}, values)}});
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_THROW(ReadNpz(path), InputError);
  std::ofstream(path) << "not a zip at all";
  EXPECT_THROW(ReadNpz(path), InputError);
  EXPECT_THROW(ReadNpz(folder.path() / "none.npz"), InputError);
}

// 20,000 points a pose, of the shapes that the phantom's description gives.
TEST(NpzFile, NumPysOwnFilesAreRead) {
  if (!HasSharedData()) GTEST_SKIP() << "no shared data here";
  const NpyArrays truth = ReadNpz(SharedData() / "phantom/knee-dev-half/truth/pose01_points.npz");
  const size_t count = ArrayNamed(truth, "template").shape.at(0);
  EXPECT_GT(count, 1000u);
  EXPECT_THAT(ArrayNamed(truth, "position").shape, ElementsAre(count, 3));
  for (const char* name : {"bone", "tissue", "in_fov", "hidden"}) {
    EXPECT_EQ(AsDoubles(ArrayNamed(truth, name)).size(), count) << name;
  }
  for (const double flag : AsDoubles(ArrayNamed(truth, "in_fov"))) ASSERT_TRUE(flag == 0 || flag == 1);
  for (const double x : AsDoubles(ArrayNamed(truth, "template")))
    ASSERT_LT(std::abs(x), 1000) << "millimetres";
}

}  // namespace
}  // namespace kvx
