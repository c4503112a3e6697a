// Archives of a series: what comes out of them, and that nothing leaves their folder.
#include "storage/files/archive.h"

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
void WriteTar(const fs::path& path, const std::vector<std::pair<std::string, std::string>>& entries,
              bool packed = true) {
  const locale_t utf8 = newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
  uselocale(utf8);
  archive* out = archive_write_new();
  archive_write_set_format_pax_restricted(out);
  if (packed) archive_write_add_filter_gzip(out);
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

// Stored, with a name that is "in UTF-8" by its own account.
std::string Zip(const fs::path& path, const std::string& name, const std::string& content) {
  archive* out = archive_write_new();
  archive_write_set_format_zip(out);
  archive_write_zip_set_compression_store(out);
  archive_write_open_filename(out, path.c_str());
  archive_entry* entry = archive_entry_new();
  archive_entry_set_pathname(entry, std::string(name.size(), 'n').c_str());
  archive_entry_set_perm(entry, 0644);
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_entry_set_size(entry, la_int64_t(content.size()));
  archive_write_header(out, entry);
  archive_write_data(out, content.data(), content.size());
  archive_entry_free(entry);
  archive_write_free(out);
  std::string bytes = testing_support::Content(path);
  for (const auto& [signature, flags] : {std::pair("PK\3\4", 7), std::pair("PK\1\2", 9)})
    bytes[bytes.find(signature) + size_t(flags)] |= 8;
  for (size_t at = 0; (at = bytes.find(std::string(name.size(), 'n'), at)) != bytes.npos;)
    bytes.replace(at, name.size(), name);
  std::ofstream(path, std::ios::binary) << bytes;
  return bytes;
}

TEST(Archive, ANameInAnotherScriptThanItIsSaidToBeInIsNoDamage) {
  const ArchiveWorld w;
  const std::string shift_jis = "\x8e\xe8\x8e\xf1", dicom = std::string(128, '\0') + "DICM and more";
  Zip(w.archive, shift_jis + ".dcm", dicom);
  EXPECT_EQ(w.Unpack(), 1);
  EXPECT_TRUE(fs::exists(w.folder / (Sha256(dicom).Hex().substr(0, 32) + ".dcm")));
  for (const auto& [name, content] : {std::pair("/", ""), std::pair(".txt", "see the images")}) {
    Zip(w.archive, shift_jis + name, content);
    EXPECT_THROW(w.Unpack(), InputError) << "there is no image in it";
  }
}

// Its list of contents stands at the end: without it nobody knows what else there was.
TEST(Archive, AZipWithoutItsEndIsDamaged) {
  const ArchiveWorld w;
  const std::string whole = Zip(w.archive, "1.dcm", std::string(5000, 'x'));
  ASSERT_EQ(w.Unpack(), 1);
  for (const size_t left : {whole.find("PK\1\2"), whole.size() - 1, whole.size() / 2}) {
    std::ofstream(w.archive, std::ios::binary) << whole.substr(0, left);
    EXPECT_THROW(w.Unpack(), InputError) << left << " of " << whole.size();
  }
}

TEST(Archive, ATarThatEndsBetweenTwoFilesIsCutOff) {
  const ArchiveWorld w;
  WriteTar(w.archive, {{"1.dcm", std::string(512, 'a')}, {"2.dcm", std::string(512, 'b')}}, false);
  EXPECT_EQ(w.Unpack(), 2);
  const std::string whole = testing_support::Content(w.archive);
  for (const size_t files : {1, 2}) {
    std::ofstream(w.archive, std::ios::binary) << whole.substr(0, files * 1024);
    EXPECT_THROW(w.Unpack(), InputError) << files;
  }
  std::ofstream(w.archive, std::ios::binary) << whole.substr(0, 2 * 1024 + 512);
  EXPECT_EQ(w.Unpack(), 2) << "one block of zeros is an end";
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
