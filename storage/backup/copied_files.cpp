// Each file takes its name last: what stands in a copy is whole.
#include "storage/backup/copied_files.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>

#include "core/errors.h"
#include "core/text/hex_digest.h"
#include "storage/files/blob_store.h"
#include "storage/files/data_folder.h"
#include "storage/files/flush_to_disk.h"
#include "storage/ids.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
constexpr const char *kUploads = "blobs", *kModels = "models", *kArtifacts = "artifacts";
constexpr const char* kFolders[] = {kUploads, kModels, kArtifacts};
constexpr const char* kNotWritten = "the copy cannot be written; is the disk full?";
constexpr const char* kNotRead =
    "what is copied cannot be read; is its disk sound, and may this user read all of its folder?";

// Of the upload or model that a file below its folders belongs to; of an artefact its own.
std::string NameOf(const fs::path& file) {
  const std::vector<std::string> parts(file.begin(), file.end());
  if (parts.size() < 3) return {};
  return parts[0] == kModels ? parts[1] : parts[2].substr(0, parts[2].find('.'));
}

// Named as a data folder names what is below its folders: <64 hex digits>, <64 hex digits>.kva, mdl_...
bool IsOurs(const fs::path& file) {
  const std::string name = NameOf(file);
  return *file.begin() == kModels ? LooksLikeId(name, "mdl") : IsHexDigest(name);
}

bool Passing(const fs::path& file) {  // a name that is given before the file is whole
  const std::string name = file.filename().string();
  return file.extension() == kCopying ||
         (file.extension() != ".kva" && name.find(".kva.") != std::string::npos);
}

std::vector<fs::path> AllBelow(const fs::path& root, const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(root / folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), root));
  }
  return files;
}

[[noreturn]] void ThrowNotRead(const std::error_code& error) {
  if (IsDenial(error)) throw Denied(kNotRead);
  throw Unavailable(kNotRead);
}

// Of what is copied.
std::vector<fs::path> FilesBelow(const fs::path& root, const fs::path& folder) try {
  std::vector<fs::path> files = AllBelow(root, folder);
  std::erase_if(files, Passing);
  return files;
} catch (const fs::filesystem_error& error) {
  ThrowNotRead(error.code());
}

void RequireMayRead(const fs::path& file) {
  if (!std::ifstream(file, std::ios::binary) && IsDenial(errno)) throw Denied(kNotRead);
}

// What is copied. Nothing where it cannot be read.
std::optional<Digest> DigestOf(const fs::path& file) try {
  return FileDigest(file);
} catch (const Unavailable&) {
  return std::nullopt;
}

void Flush(const fs::path& path) {
  if (!FlushToDisk(path)) throw Unavailable(kNotWritten);
}

enum class OnBadDisk { kThrow, kLeaveOut };

// Under another name first.
void CopyFile(const fs::path& from, const fs::path& to, OnBadDisk on_bad_disk, BackupFigures& figures) {
  std::error_code error;
  MakePrivateFolder(to.parent_path());
  const fs::path passing = to.string() + kCopying;
  fs::copy_file(from, passing, fs::copy_options::overwrite_existing, error);
  if (error == std::errc::no_such_file_or_directory && !fs::exists(from)) return;  // removed meanwhile
  if (error) {
    RequireMayRead(from);
    const bool readable = DigestOf(from).has_value();
    if (!readable && on_bad_disk == OnBadDisk::kLeaveOut) return void(fs::remove(passing));
    if (!readable) throw Unavailable(kNotRead);
    if (IsDenial(error)) throw Denied(kNotWritten);
    throw Unavailable(kNotWritten);
  }
  Flush(passing);
  fs::rename(passing, to);
  ++figures.files;
  figures.bytes += int64_t(fs::file_size(to));
}

bool SameSize(const fs::path& one, const fs::path& other) {
  std::error_code error, other_error;
  const auto size = fs::file_size(one, error), other_size = fs::file_size(other, other_error);
  return !error && !other_error && size == other_size;
}

// Whether what was copied before still stands for `file`. Of a model's document only a new copy does.
bool IsCopied(const fs::path& from, const fs::path& to, const fs::path& file, CopiedBefore before) {
  if (*file.begin() == kModels || !SameSize(from / file, to / file)) return false;
  if (before == CopiedBefore::kTrusted) return true;
  const std::optional<Digest> copied = DigestOf(to / file);
  return copied && copied == DigestOf(from / file);
}

bool IsWhole(const fs::path& upload) try { return IsIntact(upload); } catch (const Unavailable&) {
  return false;
}

using Files = std::vector<fs::path>;

// `files`: those of one upload, as it lies in `from`.
void CopyUpload(const fs::path& from, const fs::path& to, const Files& files, CopiedBefore before,
                BackupFigures& figures) {
  const fs::path copy = PathOf(to, NameOf(files.front()));
  const auto same = [&](const fs::path& file) { return SameSize(from / file, to / file); };
  if (before == CopiedBefore::kTrusted && std::ranges::all_of(files, same)) return;
  if (IsWhole(copy)) return;
  for (const bool from_nothing : {false, true}) {
    if (from_nothing) fs::remove_all(copy);
    BackupFigures copied;
    for (const fs::path& file : files) {
      if (!same(file)) CopyFile(from / file, to / file, OnBadDisk::kLeaveOut, copied);
    }
    if (IsWhole(copy)) {
      figures.files += copied.files, figures.bytes += copied.bytes;
      return;
    }
    if (copied.files == int64_t(files.size())) break;
  }
  fs::remove_all(copy);
}

// An upload's files follow each other.
std::vector<Files> Uploads(const fs::path& root) {
  std::vector<Files> uploads;
  for (const fs::path& file : FilesBelow(root, kUploads)) {
    if (!IsOurs(file)) continue;
    if (uploads.empty() || NameOf(uploads.back().front()) != NameOf(file)) uploads.emplace_back();
    uploads.back().push_back(file);
  }
  return uploads;
}

bool HasGone(const fs::path& file, const fs::path& data) { return Passing(file) || !fs::exists(data / file); }

}  // namespace

fs::path PathOf(const fs::path& root, const std::string& name) {
  if (IsHexDigest(name)) return root / kUploads / name.substr(0, 2) / name;
  return root / kModels / name;
}

bool HasFoldersOfFiles(const fs::path& root) {
  return std::ranges::all_of(kFolders, [&](const char* folder) { return fs::exists(root / folder); });
}

void CopyFiles(const fs::path& from, const fs::path& to, CopiedBefore before, BackupFigures& figures,
               const Progress& progress) {
  for (const char* folder : kFolders) MakePrivateFolder(to / folder);
  const std::vector<Files> uploads = Uploads(from);
  Files others = FilesBelow(from, kModels);
  std::ranges::copy(FilesBelow(from, kArtifacts), std::back_inserter(others));
  const double count = double(uploads.size() + others.size());
  double done = 0;
  for (const Files& upload : uploads) {
    progress.Report("copying", done++ / count);
    CopyUpload(from, to, upload, before, figures);
  }
  for (const fs::path& file : others) {
    progress.Report("copying", done++ / count);
    if (!IsCopied(from, to, file, before)) CopyFile(from / file, to / file, OnBadDisk::kThrow, figures);
  }
}

Files WhatWent(const fs::path& data, const fs::path& backup) {
  Files went;
  for (const char* folder : kFolders) {
    for (const fs::path& file : AllBelow(backup, folder)) {
      if (IsOurs(file) && HasGone(file, data)) went.push_back(file);
    }
  }
  return went;
}

void RemoveWhatWent(const Files& went, const std::set<std::string>& named, const fs::path& data,
                    const fs::path& backup) {
  for (const fs::path& file : went) {
    const bool stays = *file.begin() != kArtifacts && named.contains(NameOf(file)) && !Passing(file);
    if (!stays && HasGone(file, data)) fs::remove(backup / file);
  }
}

}  // namespace kvx
