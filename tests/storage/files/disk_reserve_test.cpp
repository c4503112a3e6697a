// What is kept and can be made again leaves the disk to what cannot.
#include <gtest/gtest.h>

#include <fstream>

#include "storage/files/result_cache.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

// A disk of 100 kB of which others have some.
TEST(ResultCache, ResultsLeaveTheDiskItsReserve) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "r";
  int64_t of_others = 50'000;
  const auto has_room = [&](int64_t more_bytes) {
    int64_t results = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      results += int64_t(entry.file_size());
    return of_others + results + more_bytes <= 100'000;
  };
  ResultCache cache(folder, 1 << 20, 1000, has_room);
  const auto make = [](const std::filesystem::path& file) {
    std::ofstream(file) << std::string(20'000, 'x');
  };
  for (const char* name : {"a", "b", "c"}) cache.Get(name, make);
  EXPECT_FALSE(cache.Find("a")) << "used longest ago";
  EXPECT_EQ(cache.Figures().bytes, 40'000);
  cache.MakeRoom(25'000);
  EXPECT_EQ(cache.Figures().bytes, 20'000);
  cache.MakeRoom(60'000);
  EXPECT_EQ(cache.Figures().bytes, 20'000) << "all of them would not do";
  of_others = 90'000;
  cache.CountOthers();
  EXPECT_EQ(cache.Figures().files, 1) << "the last one is what somebody has just asked for";
}

}  // namespace
}  // namespace kvx
