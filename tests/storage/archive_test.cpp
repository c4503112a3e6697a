// Archives of a series: what comes out of them, and that nothing leaves their folder.
#include "storage/archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <locale.h>

#include <fstream>

#include "core/digest.h"
#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
using testing_support::FilesUnder;
using testing_support::ScratchFolder;

// name -> content; a content of "->x" makes a symbolic link to x. Names are UTF-8, and the archive says so.
void WriteTar(const fs::path& path, const std::vector<std::pair<std::string, std::string>>& entries) {
  const locale_t utf8 = newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
  uselocale(utf8);
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
  uselocale(LC_GLOBAL_LOCALE);
  freelocale(utf8);
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

TEST(Archive, NamesMayBeInAnyScript) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"手/画像1.dcm", "one"}, {"手/Röntgen.dcm", "two"}, {"手/.DS_Store", "x"}});
  EXPECT_EQ(w.Unpack(), 2);
  EXPECT_EQ(FilesUnder(w.folder), 2u);
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

TEST(Archive, HoldsNoImagesInHiddenFolders) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"./a/.old/1.dcm", "one"}, {"./DICOMDIR_1/2.dcm", "two"}});
  EXPECT_EQ(w.Unpack(), 1);
  EXPECT_TRUE(fs::exists(w.folder / (Sha256("two").Hex().substr(0, 32) + ".dcm")));
}

}  // namespace
}  // namespace kvx
