// A series that is packed for an upload and unpacked by a service.
#include "pipeline/io/dicom/pack_series.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/digest.h"
#include "core/errors.h"
#include "storage/files/archive.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

struct PackedWorld {
  testing_support::ScratchFolder scratch;
  fs::path archive = scratch.path() / "a.tar.gz", series = scratch.path() / "series",
           unpacked = scratch.path() / "out";
  PackedWorld() { fs::create_directories(series), fs::create_directories(unpacked); }
};

std::string Binary(const std::string& text) { return text + '\0'; }

TEST(PackSeries, AServiceUnpacksItAgain) {
  const PackedWorld w;
  std::ofstream(w.series / "DOE_1") << Binary("one");
  std::ofstream(w.series / "DOE_2") << Binary("two");
  PackSeries(w.series, w.archive);
  EXPECT_EQ(testing_support::Content(w.archive).substr(4, 4), std::string(4, '\0'))
      << "the hour of packing: what was sent of it would not be known again";
  EXPECT_EQ(UnpackSeries(w.archive, w.unpacked), 2);
  EXPECT_TRUE(fs::exists(w.unpacked / (Sha256(Binary("two")).Hex().substr(0, 32) + ".dcm")));
}

TEST(PackSeries, HoldsWhatAReaderOfTheFolderFinds) {
  const PackedWorld w;
  fs::create_directories(w.series / "S1/more");
  std::ofstream(w.series / "README.txt") << "see the images";
  std::ofstream(w.series / "DICOMDIR") << "a list of them";
  EXPECT_THROW(PackSeries(w.series, w.archive), InputError);
  std::ofstream(w.series / "S1/IM1") << Binary("one");
  std::ofstream(w.series / "S1/more/IM2.dcm") << "two";
  for (const char* folder : {".old", "DICOMDIR_1"}) {
    fs::create_directories(w.series / folder);
    std::ofstream(w.series / folder / "IM3") << Binary(folder);
  }
  PackSeries(w.series, w.archive);
  EXPECT_EQ(UnpackSeries(w.archive, w.unpacked), 3);
  fs::create_symlink("gone", w.series / "IM4");
  EXPECT_THROW(PackSeries(w.series, w.archive), InputError);
}

TEST(PackSeries, AnImageThatCannotBeReadToItsEndIsRefused) {
  const PackedWorld w;
  std::ofstream(w.series / "IM1") << Binary("one");
  fs::create_symlink("/proc/self/mem", w.series / "IM2.dcm");  // no byte of it can be read at its beginning
  EXPECT_THROW(PackSeries(w.series, w.archive), InputError);
}

TEST(PackSeries, IsStoppedBetweenTwoImages) {
  const PackedWorld w;
  std::ofstream(w.series / "IM1") << Binary("one");
  std::ofstream(w.series / "IM2") << Binary("two");
  std::vector<double> told;
  const Progress stopped([&](std::string_view, double fraction) { told.push_back(fraction); },
                         [&] { return !told.empty(); });
  EXPECT_THROW(PackSeries(w.series, w.archive, stopped), Cancelled);
  EXPECT_EQ(told, std::vector<double>{0});
}

TEST(PackSeries, AFullDiskIsTold) {
  const PackedWorld w;
  std::ofstream(w.series / "IM1") << Binary("one");
  EXPECT_THROW(PackSeries(w.series, "/dev/full"), Unavailable);
}

}  // namespace
}  // namespace kvx
