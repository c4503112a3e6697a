// Nobody takes a part of a file for all of it.
#include "pipeline/io/whole_file.h"

#include <gtest/gtest.h>

#include "tests/support/failing_new.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

TEST(WholeFile, IsAllOfItOrAFailure) {
  const testing_support::ScratchFolder scratch;
  const auto path = scratch.path() / "file";
  const std::string bytes(200'000, 'b');
  std::ofstream(path, std::ios::binary) << bytes;
  std::string read;
  EXPECT_GT(testing_support::TimesWithoutMemory([&] { read = WholeFile(path); }), 10);
  EXPECT_EQ(read, bytes);
  EXPECT_EQ(WholeFile(scratch.path() / "nothing"), "");
  EXPECT_THROW(WholeFile(scratch.path()), Unavailable) << "a folder can be opened, and not read";
}

}  // namespace
}  // namespace kvx
