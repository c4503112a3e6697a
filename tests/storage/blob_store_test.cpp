// Blobs are complete or absent; the same bytes lie once; archives cannot leave their folder.
#include "storage/blob_store.h"

#include <archive.h>
#include <archive_entry.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "storage/archive.h"
#include "storage/result_cache.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
using testing_support::ScratchFolder;

size_t FilesUnder(const fs::path& folder) {
  size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) files += entry.is_regular_file();
  return files;
}

IncomingBlob Receive(BlobStore& store, const std::string& bytes, int64_t quota = 1 << 20) {
  IncomingBlob blob = store.Receive(".bin", quota);
  for (size_t i = 0; i < bytes.size(); i += 3)
    blob.Write(std::span(bytes).subspan(i, std::min<size_t>(3, bytes.size() - i)));
  return blob;
}

TEST(BlobStore, KeepsBytesUnderTheirDigestOnce) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  const std::string name = store.Keep(Receive(store, "abc"));
  EXPECT_EQ(name, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-2
  EXPECT_EQ(store.Keep(Receive(store, "abc")), name);
  EXPECT_EQ(FilesUnder(scratch.path()), 1u);
  EXPECT_EQ(testing_support::Content(store.PathOf(name)), "abc");
}

TEST(BlobStore, WhatIsNotKeptLeavesNothing) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  { const IncomingBlob blob = Receive(store, "half a fi"); }
  EXPECT_THROW(Receive(store, "far too long", 5), QuotaExceeded);
  EXPECT_EQ(FilesUnder(scratch.path()), 0u);
}

TEST(BlobStore, TheQuotaItselfMayBeSent) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  EXPECT_EQ(Receive(store, "12345", 5).bytes(), 5);
  EXPECT_THROW(Receive(store, "123456", 5), QuotaExceeded);
}

// There is an upload under way at every moment: a removal would wait for ever if later ones went first.
TEST(BlobStore, ARemovalThatWaitsGoesBeforeLaterUploads) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  std::mutex mutex;
  std::vector<std::string> order;
  const auto went = [&](const char* who) {
    const std::lock_guard lock(mutex);
    order.push_back(who);
  };
  auto upload = std::make_unique<std::shared_lock<std::shared_mutex>>(store.KeepRemovalOut());
  std::atomic<bool> asking{false};
  std::thread removal([&] {
    asking = true;
    const auto alone = store.KeepOthersOut();
    went("removal");
  });
  while (!asking) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // until it waits
  std::thread later([&] {
    const auto another = store.KeepRemovalOut();
    went("later upload");
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  went("upload");
  upload.reset();
  removal.join();
  later.join();
  EXPECT_EQ(order, (std::vector<std::string>{"upload", "removal", "later upload"}));
}

TEST(BlobStore, ACrashLeavesNoPartialBlob) {
  const ScratchFolder scratch;
  fs::create_directories(scratch.path() / "incoming");
  std::ofstream(scratch.path() / "incoming/in_left_by_a_crash.nii") << "half";
  BlobStore store(scratch.path());
  EXPECT_EQ(FilesUnder(scratch.path()), 0u);
}

// A folder on another disk than the scratch folders are: in memory.
class OtherDisk {
 public:
  OtherDisk() {
    std::string name = "/dev/shm/kinevox-test-XXXXXX";
    if (::mkdtemp(name.data())) path_ = name;
  }
  ~OtherDisk() {
    if (!path_.empty()) fs::remove_all(path_);
  }
  OtherDisk(const OtherDisk&) = delete;
  OtherDisk& operator=(const OtherDisk&) = delete;
  const fs::path& path() const { return path_; }
  bool IsOther(const fs::path& folder) const {
    struct stat here {};
    struct stat there {};
    return !path_.empty() && ::stat(path_.c_str(), &here) == 0 && ::stat(folder.c_str(), &there) == 0 &&
           here.st_dev != there.st_dev;
  }

 private:
  fs::path path_;
};

// As where a disk knows no links at all (exFAT).
TEST(BlobStore, WhatCannotBeLinkedIsCopied) {
  const ScratchFolder scratch;
  const OtherDisk disk;
  if (!disk.IsOther(scratch.path())) GTEST_SKIP() << "/dev/shm is no disk of its own";
  BlobStore store(scratch.path());
  std::ofstream(disk.path() / "upl_whole") << "abc";
  const std::string name = store.Keep(store.Adopt(disk.path() / "upl_whole", ".nii"));
  EXPECT_EQ(testing_support::Content(store.PathOf(name)), "abc");
  EXPECT_EQ(testing_support::Content(disk.path() / "upl_whole"), "abc") << "it is its owner's to remove";
  EXPECT_EQ(FilesUnder(scratch.path()), 1u);
}

TEST(BlobStore, PartsOnDifferentDisksAreRefused) {
  const ScratchFolder scratch;
  const OtherDisk disk;
  if (!disk.IsOther(scratch.path())) GTEST_SKIP() << "/dev/shm is no disk of its own";
  fs::create_directory_symlink(disk.path(), scratch.path() / "blobs");
  const std::string refusal = testing_support::RefusalOf<Unavailable>([&] { BlobStore(scratch.path()); });
  EXPECT_THAT(refusal, testing::HasSubstr("different disks"));
}

TEST(BlobStore, FoldersAreKeptUnderTheDigestOfTheirFiles) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  const auto keep = [&](const std::string& second) {
    IncomingFolder folder = store.ReceiveFolder();
    std::ofstream(folder.path() / "1") << "one";
    std::ofstream(folder.path() / "2") << second;
    return store.KeepFolder(std::move(folder));
  };
  const std::string name = keep("two");
  EXPECT_EQ(keep("two"), name);
  EXPECT_NE(keep("three"), name);
  EXPECT_EQ(FilesUnder(scratch.path()), 4u);
}

TEST(BlobStore, BytesThatCameAgainReplaceDamagedOnes) {
  const ScratchFolder scratch;
  BlobStore store(scratch.path());
  const auto keep_file = [&] { return store.Keep(Receive(store, "abc")); };
  const auto keep_folder = [&] {
    IncomingFolder folder = store.ReceiveFolder();
    std::ofstream(folder.path() / "1") << "one";
    std::ofstream(folder.path() / "2") << "two";
    return store.KeepFolder(std::move(folder));
  };
  const fs::path file = store.PathOf(keep_file()), folder = store.PathOf(keep_folder());
  EXPECT_TRUE(IsIntact(file));
  EXPECT_TRUE(IsIntact(folder));
  for (const char* damaged : {"abd", "ab", ""}) {
    std::ofstream(file) << damaged;
    EXPECT_FALSE(IsIntact(file)) << damaged;
  }
  fs::remove(folder / "2");
  EXPECT_FALSE(IsIntact(folder));
  keep_file();
  keep_folder();
  EXPECT_TRUE(IsIntact(file));
  EXPECT_TRUE(IsIntact(folder));
  EXPECT_EQ(FilesUnder(scratch.path()), 3u);
  EXPECT_FALSE(IsIntact(scratch.path() / "nowhere"));
}

// name -> content; a content of "->x" makes a symbolic link to x.
void WriteTar(const fs::path& path, const std::vector<std::pair<std::string, std::string>>& entries) {
  archive* out = archive_write_new();
  archive_write_set_format_pax_restricted(out);
  archive_write_add_filter_gzip(out);
  archive_write_open_filename(out, path.c_str());
  for (const auto& [name, content] : entries) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_perm(entry, 0644);
    const bool link = content.starts_with("->");
    archive_entry_set_filetype(entry, link ? AE_IFLNK : AE_IFREG);
    if (link) archive_entry_set_symlink(entry, content.c_str() + 2);
    archive_entry_set_size(entry, link ? 0 : la_int64_t(content.size()));
    archive_write_header(out, entry);
    if (!link) archive_write_data(out, content.data(), content.size());
    archive_entry_free(entry);
  }
  archive_write_free(out);
}

struct ArchiveWorld {
  ScratchFolder scratch;
  fs::path archive = scratch.path() / "a.tar.gz", folder = scratch.path() / "in/out";
  ArchiveWorld() { fs::create_directories(folder); }
  int Unpack(const ArchiveLimits& limits = {}) const { return UnpackSeries(archive, folder, limits); }
};

TEST(Archive, UnpacksSlicesWithoutTheirNames) {
  const ArchiveWorld w;
  WriteTar(
      w.archive,
      {{"DOE^JANE/1.dcm", "one"}, {"DOE^JANE/2.dcm", "two"}, {"DOE^JANE/.DS_Store", "x"}, {"DICOMDIR", "y"}});
  EXPECT_EQ(w.Unpack(), 2);
  EXPECT_EQ(FilesUnder(w.folder), 2u);
  EXPECT_TRUE(fs::exists(w.folder / (Sha256("one").Hex().substr(0, 32) + ".dcm")));
}

std::string Binary(const std::string& text) { return text + '\0'; }

TEST(Archive, LeavesOutWhatMediaPutBesideTheImages) {
  const ArchiveWorld w;
  const std::string dicom = std::string(128, '\0') + "DICM and more";
  WriteTar(w.archive, {{"readme.txt", "see the images"},
                       {"AUTORUN.INF", ""},
                       {"viewer.exe", "MZ"},
                       {"README", "see the images"},
                       {"IM1", Binary("an old image")},
                       {"1.2.840.17", Binary("another")},
                       {"odd.name", dicom}});
  EXPECT_EQ(w.Unpack(), 3);
  EXPECT_EQ(FilesUnder(w.folder), 3u);
}

TEST(Archive, NoPathLeavesTheFolder) {
  for (const char* name : {"../evil.dcm", "a/../../evil.dcm", "/tmp/kinevox-evil.dcm"}) {
    const ArchiveWorld w;
    WriteTar(w.archive, {{name, "evil"}});
    EXPECT_THROW(w.Unpack(), InputError) << name;
    EXPECT_EQ(FilesUnder(w.scratch.path()), 1u) << "only the archive";
  }
  EXPECT_FALSE(fs::exists("/tmp/kinevox-evil.dcm"));
}

TEST(Archive, RefusesLinks) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"a.dcm", "->/etc/passwd"}});
  EXPECT_THROW(w.Unpack(), InputError);
}

TEST(Archive, HasCaps) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"a.dcm", std::string(400'000, 'a')}, {"b.dcm", std::string(400'000, 'b')}});
  EXPECT_THROW(w.Unpack({.entries = 1}), InputError);
  EXPECT_THROW(w.Unpack({.total_bytes = 500'000}), InputError);
  EXPECT_THROW(w.Unpack({.ratio = 20, .ratio_from_bytes = 100'000}), InputError);
  EXPECT_EQ(w.Unpack(), 2);
}

// What is left out is unpacked all the same, to come to the next entry.
TEST(Archive, WhatIsLeftOutCountsToo) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{".hidden", std::string(900'000, 'a')}, {"a.dcm", "one"}});
  EXPECT_THROW(w.Unpack({.total_bytes = 500'000}), InputError);
  EXPECT_THROW(w.Unpack({.ratio = 20, .ratio_from_bytes = 100'000}), InputError);
  EXPECT_EQ(w.Unpack(), 1);
}

TEST(Archive, RefusesWhatIsNone) {
  const ArchiveWorld w;
  std::ofstream(w.archive) << "plain text that is no archive at all";
  EXPECT_THROW(w.Unpack(), InputError);
}

TEST(Archive, OneOfAVolumeSaysHowToSendIt) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"pose01.nii", "a volume"}});
  try {
    w.Unpack();
    FAIL() << "it holds no series";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("holds no DICOM images; send a volume"));
  }
}

TEST(Archive, PackedFoldersComeBack) {
  const ArchiveWorld w;
  const fs::path series = w.scratch.path() / "series";
  fs::create_directories(series);
  std::ofstream(series / "DOE_1") << Binary("one");
  std::ofstream(series / "DOE_2") << Binary("two");
  PackFolder(series, w.archive);
  EXPECT_EQ(testing_support::Content(w.archive).substr(4, 4), std::string(4, '\0'))
      << "the hour of packing: what was sent of it would not be known again";
  EXPECT_EQ(w.Unpack(), 2);
  EXPECT_TRUE(fs::exists(w.folder / (Sha256(Binary("two")).Hex().substr(0, 32) + ".dcm")));
}

TEST(Archive, PackedFoldersHoldWhatAReaderOfTheFolderFinds) {
  const ArchiveWorld w;
  const fs::path study = w.scratch.path() / "study";
  fs::create_directories(study / "S1/more");
  std::ofstream(study / "README.txt") << "see the images";
  std::ofstream(study / "DICOMDIR") << "a list of them";
  EXPECT_THROW(PackFolder(study, w.archive), InputError);
  std::ofstream(study / "S1/IM1") << Binary("one");
  std::ofstream(study / "S1/more/IM2.dcm") << "two";
  for (const char* folder : {".old", "DICOMDIR_1"}) {
    fs::create_directories(study / folder);
    std::ofstream(study / folder / "IM3") << Binary(folder);
  }
  PackFolder(study, w.archive);
  EXPECT_EQ(w.Unpack(), 3);
  fs::create_symlink("gone", study / "IM4");
  EXPECT_THROW(PackFolder(study, w.archive), InputError);
}

TEST(Archive, HoldsNoImagesInHiddenFolders) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"./a/.old/1.dcm", "one"}, {"./DICOMDIR_1/2.dcm", "two"}});
  EXPECT_EQ(w.Unpack(), 1);
  EXPECT_TRUE(fs::exists(w.folder / (Sha256("two").Hex().substr(0, 32) + ".dcm")));
}

void WriteText(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

std::string ReadAll(const CachedFile& file) {
  std::string text(file.size(), '\0');
  text.resize(file.ReadAt(0, text.data(), text.size()));
  return text;
}

TEST(ResultCache, MakesEachResultOnceHoweverManyAsk) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 1 << 20);
  std::atomic<int> made = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&] {
      const auto file = cache.Get("a.txt", [&](const fs::path& path) {
        ++made;
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        WriteText(path, "result");
      });
      EXPECT_EQ(ReadAll(*file), "result");
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(made, 1);
}

TEST(ResultCache, DropsTheLeastRecentlyUsedAndKeepsOpenFilesReadable) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 25);
  const auto ten = [](const fs::path& path) { WriteText(path, "0123456789"); };
  const auto never = [](const fs::path&) { FAIL() << "it was kept"; };
  cache.Get("a", ten);
  const auto b = cache.Get("b", ten);
  cache.Get("a", never);  // a is newer than b now
  cache.Get("c", ten);    // b goes
  EXPECT_FALSE(fs::exists(scratch.path() / "r/b"));
  EXPECT_EQ(ReadAll(*b), "0123456789");
  cache.Get("a", never);
  EXPECT_EQ(cache.Figures().bytes, 20);
}

TEST(ResultCache, AFailureIsNotKept) {
  const ScratchFolder scratch;
  ResultCache cache(scratch.path() / "r", 100);
  EXPECT_THROW(cache.Get("a",
                         [](const fs::path& path) {
                           WriteText(path, "half");
                           throw Unavailable("no");
                         }),
               Unavailable);
  EXPECT_EQ(FilesUnder(scratch.path()), 0u);
  EXPECT_EQ(ReadAll(*cache.Get("a", [](const fs::path& path) { WriteText(path, "whole"); })), "whole");
}

TEST(ResultCache, IsTakenOverAtTheNextStart) {
  const ScratchFolder scratch;
  {
    ResultCache(scratch.path() / "r", 100).Get("a", [](const fs::path& path) { WriteText(path, "kept"); });
  }
  ResultCache again(scratch.path() / "r", 100);
  EXPECT_EQ(ReadAll(*again.Get("a", [](const fs::path&) { FAIL() << "it was there"; })), "kept");
  { ResultCache smaller(scratch.path() / "r", 1); }
  EXPECT_EQ(FilesUnder(scratch.path()), 1u)
      << "the last result is served even when it is larger than the cache";
}

}  // namespace
}  // namespace kvx
