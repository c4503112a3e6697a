// What cannot be flushed says so.
#include "storage/files/flush_to_disk.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

TEST(FlushToDisk, FilesAndFoldersAreAndWhatHasNoDiskIsNot) {
  const ScratchFolder scratch;
  std::ofstream(scratch.path() / "file") << "bytes";
  EXPECT_TRUE(FlushToDisk(scratch.path() / "file"));
  EXPECT_TRUE(FlushToDisk(scratch.path()));
  EXPECT_FALSE(FlushToDisk(scratch.path() / "nothing"));
  EXPECT_FALSE(FlushToDisk("/dev/null"));
}

}  // namespace
}  // namespace kvx
