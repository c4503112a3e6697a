// Bytes by position, from memory and from disk.
#include "storage/files/cached_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

TEST(CachedFile, IsReadByPositionFromMemoryAsFromDisk) {
  const ScratchFolder scratch;
  std::ofstream(scratch.path() / "file") << "0123456789";
  const CachedFile in_memory(std::string("0123456789")), on_disk(scratch.path() / "file");
  for (const CachedFile* file : {&in_memory, &on_disk}) {
    std::string out(4, '-');
    EXPECT_EQ(file->size(), 10u);
    EXPECT_EQ(file->ReadAt(3, out.data(), 4), 4u);
    EXPECT_EQ(out, "3456");
    EXPECT_EQ(file->ReadAt(8, out.data(), 4), 2u);
    EXPECT_EQ(out, "8956");
    EXPECT_EQ(file->ReadAt(10, out.data(), 4), 0u);
  }
}

TEST(CachedFile, WhatCannotBeReadIsToldAndIsNoEndOfTheFile) {
  const ScratchFolder scratch;
  EXPECT_THROW(CachedFile(scratch.path() / "nothing"), Unavailable);
  char byte = 0;
  EXPECT_THROW(CachedFile(scratch.path()).ReadAt(0, &byte, 1), Unavailable) << "a folder has no bytes";
}

}  // namespace
}  // namespace kvx
