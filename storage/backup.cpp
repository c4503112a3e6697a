// Blobs, artefacts and model files never change once they have their name, so copying them beside a running
// service is safe. SQLite itself copies the database first, and what it names is looked for afterwards; it
// takes its name last, so that a backup that was cut off leaves the one before it whole. A mark made first
// says whose folder it is: things are removed there.
#include "storage/backup.h"

#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <optional>
#include <vector>

#include "core/digest.h"
#include "core/errors.h"
#include "core/text/hex_digest.h"
#include "storage/database/database.h"
#include "storage/database/open_for_reading.h"
#include "storage/database/sqlite.h"
#include "storage/files/blob_store.h"
#include "storage/files/data_folder.h"
#include "storage/files/flush_to_disk.h"
#include "storage/ids.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
constexpr const char* kFolders[] = {"blobs", "models", "artifacts"};
constexpr const char* kCopying = ".copying";  // ends the name of what is not whole yet
constexpr const char* kMark = "kinevox-backup";
constexpr const char* kNotWritten = "the copy cannot be written; is the disk full?";
constexpr const char* kNotRead =
    "what is copied cannot be read; is its disk sound, and may this user read all of its folder?";
constexpr int kTries = 3;

// Named as a data folder names what is below its folders: <64 hex digits>, <64 hex digits>.kva, mdl_...
bool IsOurs(const fs::path& file) {
  const std::vector<std::string> parts(file.begin(), file.end());
  if (parts.size() < 3) return false;
  if (parts[0] == "models") return LooksLikeId(parts[1], "mdl");
  return IsHexDigest(parts[2].substr(0, parts[2].find('.')));
}

// Uploaded as one file, whose name is the digest of its bytes. A series is a folder, digested another way.
bool IsWholeBlob(const fs::path& file) { return file.parent_path().parent_path() == fs::path("blobs"); }

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

// Of what is copied.
Digest DigestRead(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) ThrowNotRead({errno, std::generic_category()});
  try {
    return FileDigest(file);
  } catch (const Unavailable&) {
    throw Unavailable(kNotRead);
  }
}

// Of a copy; nothing where it cannot be read.
std::optional<Digest> DigestOfCopy(const fs::path& file) try {
  return FileDigest(file);
} catch (const Unavailable&) {
  return std::nullopt;
}

void Flush(const fs::path& path) {
  if (!FlushToDisk(path)) throw Unavailable(kNotWritten);
}

// Under another name first: what stands in the copy is whole.
void CopyFile(const fs::path& from, const fs::path& to, BackupFigures& figures) {
  std::error_code error;
  MakePrivateFolder(to.parent_path());
  const fs::path passing = to.string() + kCopying;
  fs::copy_file(from, passing, fs::copy_options::overwrite_existing, error);
  if (error == std::errc::no_such_file_or_directory && !fs::exists(from)) return;  // removed meanwhile
  if (error) {
    DigestRead(from);  // it may be this that failed
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
  if (*file.begin() == fs::path("models") || !fs::exists(to / file)) return false;
  const bool same_size = SameSize(from / file, to / file);
  if (same_size && before == CopiedBefore::kTrusted) return true;
  const std::optional<Digest> copied = DigestOfCopy(to / file);
  if (!copied) return false;
  if (IsWholeBlob(file)) return copied->Hex() == file.filename();
  return same_size && *copied == DigestRead(from / file);
}

void CopyFolders(const fs::path& from, const fs::path& to, CopiedBefore before, BackupFigures& figures,
                 const Progress& progress) {
  std::vector<fs::path> files;
  for (const char* folder : kFolders) {
    MakePrivateFolder(to / folder);
    std::ranges::copy(FilesBelow(from, folder), std::back_inserter(files));
  }
  for (size_t i = 0; i < files.size(); ++i) {
    progress.Report("copying", double(i) / double(files.size()));
    if (!IsCopied(from, to, files[i], before)) CopyFile(from / files[i], to / files[i], figures);
  }
}

bool HasGone(const fs::path& file, const fs::path& data) { return Passing(file) || !fs::exists(data / file); }

// Of an older backup. Looked for before the records are copied, which so name nothing of it: what a subject
// leaves that is removed later stays until the next backup.
std::vector<fs::path> WhatWent(const fs::path& data, const fs::path& backup) {
  std::vector<fs::path> went;
  for (const char* folder : kFolders) {
    for (const fs::path& file : AllBelow(backup, folder)) {
      if (IsOurs(file) && HasGone(file, data)) went.push_back(file);
    }
  }
  return went;
}

// What has come again meanwhile stays.
void Remove(const std::vector<fs::path>& went, const fs::path& data, const fs::path& backup) {
  for (const fs::path& file : went) {
    if (HasGone(file, data)) fs::remove(backup / file);
  }
}

std::string TextRow(SQLite::Statement& row) { return sqlite::Text(row, 0); }

// Hash of the audit trail's last entry; nothing without one, and of records that cannot be read.
std::optional<std::string> EndOfTrail(const fs::path& records) try {
  const auto db = OpenForReading(records);
  if (!db->tableExists("audit")) return std::nullopt;
  return sqlite::One(*db, "last_audit_hash", TextRow);
} catch (const SQLite::Exception&) {
  return std::nullopt;
}

// The trail only grows: a data folder without the end of the backup's is another one, or was put back to an
// earlier state.
bool IsOfAnother(const fs::path& data, const fs::path& backup) {
  const std::optional<std::string> end = EndOfTrail(backup / kDatabaseFile);
  if (!end) return false;
  const auto db = OpenForReading(data / kDatabaseFile);
  return !db->tableExists("audit") || !sqlite::One(*db, "audit_has_hash", TextRow, *end);
}

// Their bytes are in no copy. They name people, too: what is removed is overwritten.
void DropUnfinishedUploads(const fs::path& database) {
  SQLite::Database db(database.string(), SQLite::OPEN_READWRITE, kBusyTimeoutMs);
  if (!db.tableExists("resumable")) return;  // written by a program of before
  db.exec("PRAGMA secure_delete = ON");
  sqlite::Execute(db, "remove_unfinished_resumables");
}

// Records of before have their requests elsewhere.
void RequireOfThisKind(SQLite::Database& db) {
  RequireKnown(db);
  if (db.tableExists("job_request") || !db.tableExists("job")) return;
  throw Conflict(
      "this was written by an older version of kinevox; use that version, or let 'kinevox serve' of this one "
      "open a copy of the folder once");
}

void CopyDatabase(const fs::path& from, const fs::path& to) {
  {
    const auto db = OpenForReading(from);
    RequireOfThisKind(*db);
    fs::remove(to);
    MakePrivateFile(to);  // SQLite copies into an empty file
    SQLite::Statement copy(*db, "VACUUM INTO ?1");
    copy.bind(1, to.string());
    copy.exec();
  }
  DropUnfinishedUploads(to);
  Flush(to);
}

// Where the blobs that these records name lie in the backup.
std::vector<fs::path> BlobsOf(const fs::path& database, const fs::path& backup) {
  const auto db = OpenForReading(database);
  return sqlite::All(*db, "blobs_in_use", [&](SQLite::Statement& row) {
    const std::string blob = sqlite::Text(row, 0);
    return backup / "blobs" / blob.substr(0, 2) / blob;
  });
}

bool AllThere(const std::vector<fs::path>& blobs) {
  return std::ranges::all_of(blobs, [](const fs::path& blob) { return fs::exists(blob); });
}

void RequireSound(const fs::path& backup, const Progress& progress) {
  if (!fs::exists(backup / kDatabaseFile)) throw NotFound("this folder is not a backup of a data folder");
  const auto db = OpenForReading(backup / kDatabaseFile);
  RequireOfThisKind(*db);
  const bool sound = db->execAndGet("PRAGMA integrity_check").getString() == "ok";
  const std::vector<fs::path> blobs = BlobsOf(backup / kDatabaseFile, backup);
  if (!sound || !AllThere(blobs)) throw InputError("the backup is damaged or not complete; use another one");
  for (size_t i = 0; i < blobs.size(); ++i) {
    progress.Report("checking", double(i) / double(blobs.size()));
    if (!IsIntact(blobs[i])) throw InputError("an upload in the backup is damaged; use another backup");
  }
}

bool Holds(const fs::path& folder, const fs::path& other) {
  return std::ranges::mismatch(folder, other).in1 == folder.end();
}

// A copy onto itself would replace the database under a running service.
void RequireApart(const fs::path& data, const fs::path& backup) {
  const fs::path one = fs::weakly_canonical(data / "."), other = fs::weakly_canonical(backup / ".");
  if (Holds(one, other) || Holds(other, one))
    throw InputError("a backup lies outside the data folder, and the data folder outside the backup");
}

// Backups of before the mark are known by their parts, and by what only a data folder has.
bool LooksLikeOldBackup(const fs::path& folder) {
  const auto there = [&](const char* name) { return fs::exists(folder / name); };
  const bool data_folder = there("results") || there("uploads") || there("work");
  return there(kDatabaseFile) && std::ranges::all_of(kFolders, there) && !data_folder;
}

void RequireForBackups(const fs::path& folder) {
  if (IsLocked(folder))
    throw InputError(
        "the folder to copy into is a data folder of a service; give a new or empty one, or an older backup");
  if (HoldsNothing(folder) || fs::exists(folder / kMark) || LooksLikeOldBackup(folder)) return;
  throw InputError(
      "the folder to copy into holds other things and is no backup; give a new or empty one, or an older "
      "backup");
}

[[noreturn]] void ThrowNotWritten(const std::string& folder, const std::error_code& error) {
  if (IsDenial(error)) throw Denied(folder + " may not be written; choose a place where you may write");
  if (error == std::errc::not_a_directory || error == std::errc::file_exists)
    throw InputError("a file stands where " + folder + " is to be; choose another place");
  throw Unavailable(folder + " cannot be written; is the disk full?");
}

// All of a backup is read before anything of it is written. Leaves nothing.
void RequireMayFill(const fs::path& folder) {
  const bool there = fs::exists(folder);
  MakePrivateFolder(folder);
  const fs::path tried = folder / kCopying;
  MakePrivateFile(tried);
  fs::remove(tried);
  if (!there) fs::remove(folder);
}

bool IsDamage(const SQLite::Exception& error) {
  return error.getErrorCode() == SQLITE_CORRUPT || error.getErrorCode() == SQLITE_NOTADB;
}

[[noreturn]] void ThrowFor(const SQLite::Exception& error) {
  if (IsDamage(error)) throw InputError("the database is damaged; restore the data folder from a backup");
  throw Unavailable(
      "the database cannot be copied now; is the disk full, or may this user not write to its folder?");
}

}  // namespace

BackupFigures BackUp(const fs::path& data, const fs::path& backup, CopiedBefore before,
                     const Progress& progress) try {
  if (!fs::exists(data / kDatabaseFile))
    throw NotFound("this is not a data folder of the service; give it with --data");
  RequireApart(data, backup);
  RequireForBackups(backup);
  if (IsOfAnother(data, backup))
    throw InputError(
        "the older backup is of another data folder, or of a later state of this one; is the data folder's "
        "disk mounted? Else give a new folder to copy into");
  MakePrivateFolder(backup);
  MakePrivateFile(backup / kMark);
  const fs::path records = backup / kDatabaseFile, newer = records.string() + kCopying;
  BackupFigures figures;
  std::vector<fs::path> went;
  for (int tries = 1;; ++tries) {
    went = WhatWent(data, backup);
    CopyDatabase(data / kDatabaseFile, newer);
    CopyFolders(data, backup, before, figures, progress);
    if (AllThere(BlobsOf(newer, backup)))
      break;  // else a subject was removed between: the next copy does not know it
    if (tries == kTries) throw Unavailable("records and files do not agree; try again when less is removed");
  }
  fs::rename(newer, records);
  Remove(went, data, backup);
  return figures;
} catch (const fs::filesystem_error& error) {
  ThrowNotWritten("the backup", error.code());
} catch (const SQLite::Exception& error) {
  ThrowFor(error);
}

BackupFigures Restore(const fs::path& backup, const fs::path& data, const Progress& progress) try {
  RequireApart(data, backup);
  if (!HoldsNothing(data))  // before all of the backup is read
    throw InputError(
        "the folder to restore into is not empty; give a new one, or remove what a restore that failed left "
        "there");
  RequireMayFill(data);
  RequireSound(backup, progress.Part(0, 0.5));
  BackupFigures figures;
  MakePrivateFolder(data);
  fs::permissions(data, fs::perms::owner_all);  // it may have been there, empty
  const fs::path records = data / kDatabaseFile, passing = records.string() + kCopying;
  CopyDatabase(backup / kDatabaseFile, passing);
  CopyFolders(backup, data, CopiedBefore::kTrusted, figures, progress.Part(0.5, 1));
  if (!AllThere(BlobsOf(passing, data)))
    throw Unavailable(
        "what is restored from has changed meanwhile; remove the new folder and try again, from a backup "
        "that no service and no other backup works on");
  fs::rename(passing, records);
  MakeLocked(data);
  return figures;
} catch (const fs::filesystem_error& error) {
  ThrowNotWritten("the data folder", error.code());
} catch (const SQLite::Exception& error) {
  if (IsDamage(error)) throw InputError("the backup's database is damaged; use another backup");
  throw Unavailable("the database cannot be copied; is the disk full, or may this user not read the backup?");
}

}  // namespace kvx
