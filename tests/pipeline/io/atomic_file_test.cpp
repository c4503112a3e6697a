// Files are complete or absent, whatever happens while they are written.
#include "pipeline/io/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::Content;

size_t Files(const std::filesystem::path& folder) {
  return size_t(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(AtomicFile, WritesAndReplaces) {
  const testing_support::ScratchFolder scratch;
  WriteFileAtomically(scratch.path() / "a.txt", "one");
  WriteFileAtomically(scratch.path() / "a.txt", std::string_view("t\0o", 3));
  EXPECT_EQ(Content(scratch.path() / "a.txt"), std::string("t\0o", 3));
  EXPECT_EQ(Files(scratch.path()), 1u);
}

TEST(AtomicFile, AFailedWriteKeepsWhatWasThere) {
  const testing_support::ScratchFolder scratch;
  WriteFileAtomically(scratch.path() / "a.nii.gz", "one");
  {
    const AtomicFile file(scratch.path() / "a.nii.gz");  // never committed
    EXPECT_TRUE(file.temporary().string().ends_with(".nii.gz"));
    std::ofstream(file.temporary()) << "half";
  }
  EXPECT_EQ(Content(scratch.path() / "a.nii.gz"), "one");
  EXPECT_EQ(Files(scratch.path()), 1u);
}

TEST(AtomicFile, AFolderOfThatNameIsRefusedAndKept) {
  const testing_support::ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "a.nii.gz");
  EXPECT_THROW(AtomicFile(scratch.path() / "a.nii.gz"), InputError);
  EXPECT_TRUE(std::filesystem::is_directory(scratch.path() / "a.nii.gz"));
  EXPECT_EQ(Files(scratch.path()), 1u);
}

TEST(AtomicFile, AMissingFolderIsAnError) {
  const testing_support::ScratchFolder scratch;
  EXPECT_THROW(WriteFileAtomically(scratch.path() / "none" / "a.txt", "one"), InputError);
}

TEST(AtomicFile, ADashIsNoFile) {
  EXPECT_THROW(AtomicFile("-"), InputError) << "who writes it means stdout";
  const testing_support::ScratchFolder folder;
  WriteFileAtomically(folder.path() / "-", "one");
  EXPECT_EQ(Content(folder.path() / "-"), "one");
}

TEST(AtomicFile, ALinkStaysALink) {
  const testing_support::ScratchFolder folder;
  WriteFileAtomically(folder.path() / "real", "old");
  std::filesystem::create_symlink("real", folder.path() / "link");
  WriteFileAtomically(folder.path() / "link", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link"));
  EXPECT_EQ(testing_support::Content(folder.path() / "real"), "new");
}

TEST(AtomicFile, DevicesAndPipesAreRefused) {
  const testing_support::ScratchFolder folder;
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  EXPECT_THROW(AtomicFile(folder.path() / "pipe"), InputError);
  EXPECT_TRUE(std::filesystem::is_fifo(folder.path() / "pipe"));
  EXPECT_THROW(AtomicFile("/dev/null"), InputError);
}

TEST(AtomicFile, ANameMayBeAsLongAsTheDiskTakes) {
  const testing_support::ScratchFolder folder;
  for (const size_t bytes : {200, 240, 255}) {
    const std::string name = std::string(bytes - 7, 'n') + ".nii.gz";
    WriteFileAtomically(folder.path() / name, "new");
    EXPECT_EQ(Content(folder.path() / name), "new") << bytes;
    EXPECT_TRUE(AtomicFile(folder.path() / name).temporary().string().ends_with(".nii.gz"));
  }
  EXPECT_THROW(AtomicFile(folder.path() / std::string(256, 'n')), InputError);
}

// By descriptor: under its name it has a writer already, who may be at its end (>>) or in its middle.
TEST(AtomicFile, AnOpenFileIsRefusedAndKept) {
  const testing_support::ScratchFolder folder;
  const std::filesystem::path all = folder.path() / "all.csv";
  WriteFileAtomically(all, "rows");
  const int open = ::open(all.c_str(), O_WRONLY | O_APPEND);
  const std::string name = "/fd/" + std::to_string(open);
  std::filesystem::create_symlink("/dev" + name, folder.path() / "link");
  for (const std::string& path : {"/dev" + name, "/proc/self" + name}) {
    EXPECT_THROW(WriteFileAtomically(path, "new"), InputError) << path;
  }
  EXPECT_THROW(WriteFileAtomically(folder.path() / "link", "new"), InputError);
  ::close(open);
  EXPECT_EQ(Content(all), "rows");
}

TEST(AtomicFile, ALinkToNothingGetsWhatItNames) {
  const testing_support::ScratchFolder folder;
  std::filesystem::create_directory(folder.path() / "real");
  std::filesystem::create_symlink("real/a.txt", folder.path() / "between");
  std::filesystem::create_symlink(folder.path() / "between", folder.path() / "link");
  WriteFileAtomically(folder.path() / "link", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "between"));
  EXPECT_EQ(Content(folder.path() / "real" / "a.txt"), "new");
}

// Two files of one process and one name, one after the other: who saw the first cannot tell the second's
// name.
TEST(AtomicFile, TemporaryNamesCannotBeForeseen) {
  const testing_support::ScratchFolder scratch;
  std::filesystem::path first;
  {
    const AtomicFile file(scratch.path() / "a.txt");
    first = file.temporary();
  }
  const AtomicFile other(scratch.path() / "a.txt"), third(scratch.path() / "a.txt");
  EXPECT_NE(first, other.temporary());
  EXPECT_NE(other.temporary(), third.temporary());
}

}  // namespace
}  // namespace kvx
