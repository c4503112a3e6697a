// Uploads, artefacts and model files never change once they have their name, so copying them beside a running
// service is safe. The database is copied first, and what it names is looked for afterwards; it takes its
// name last, so that a backup that was cut off leaves the one before it whole. A mark made first says whose
// folder it is: things are removed there.
#include "storage/backup.h"

#include <sqlite3.h>

#include <algorithm>

#include "core/errors.h"
#include "core/text/hex_digest.h"
#include "core/text/listed.h"
#include "storage/backup/copied_files.h"
#include "storage/backup/copied_records.h"
#include "storage/database/open_for_reading.h"
#include "storage/files/blob_store.h"
#include "storage/files/data_folder.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;  // of uploads and models
constexpr const char* kMark = "kinevox-backup";
constexpr int kTries = 3;

// Of what is copied.
bool IsThere(const fs::path& path) {
  std::error_code error;
  const bool there = fs::exists(path, error);
  if (IsDenial(error))
    throw Denied(
        "what is copied may not be read; give the user of this program the right to all of its folder");
  return there;
}

// Of those named, what is not in the folder.
Names MissingIn(const fs::path& root, Names named) {
  std::erase_if(named, [&](const std::string& name) { return IsThere(PathOf(root, name)); });
  return named;
}

// As MissingIn, and what is not as it was uploaded.
Names LostIn(const fs::path& backup, const Names& named, const Progress& progress) {
  Names lost = MissingIn(backup, named);
  double done = 0;
  for (const std::string& name : named) {
    progress.Report("checking", done++ / double(named.size()));
    if (IsHexDigest(name) && !lost.contains(name) && !IsIntact(PathOf(backup, name))) lost.insert(name);
  }
  return lost;
}

// Returns what has been lost of what the records name.
Names RequireSound(const fs::path& backup, Lost lost, const Progress& progress) {
  const fs::path records = backup / kDatabaseFile;
  const auto db = OpenForReading(records);
  RequireOfThisKind(*db);
  if (db->execAndGet("PRAGMA integrity_check").getString() != "ok")
    throw InputError("the backup's database is damaged; use another backup");
  const Names names = LostIn(backup, NamedBy(records), progress);
  if (names.empty() || lost == Lost::kLeftOut) return names;
  throw InputError("damaged or lost in the backup: " + Listed(HoldersOf(names, records)) +
                   "; use another backup, or restore the rest with --incomplete");
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
  return there(kDatabaseFile) && HasFoldersOfFiles(folder) && !data_folder;
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
  const fs::path records = data / kDatabaseFile;
  if (!IsThere(records)) throw NotFound("this is not a data folder of the service; give it with --data");
  RequireApart(data, backup);
  RequireForBackups(backup);
  if (IsOfAnother(data, backup))
    throw InputError(
        "the older backup is of another data folder, or of a later state of this one; is the data folder's "
        "disk mounted? Else give a new folder to copy into");
  MakePrivateFolder(backup);
  MakePrivateFile(backup / kMark);
  const fs::path copied = backup / kDatabaseFile, newer = copied.string() + kCopying;
  BackupFigures figures;
  for (int tries = 1;; ++tries) {
    const std::vector<fs::path> went = WhatWent(data, backup);
    CopyRecords(records, newer);
    CopyFiles(data, backup, before, figures, progress);
    const Names named = NamedBy(newer), lost = MissingIn(backup, named);
    if (std::ranges::includes(NamedBy(records), lost)) {
      figures.lost = HoldersOf(lost, newer);
      fs::rename(newer, copied);
      RemoveWhatWent(went, named, data, backup);
      return figures;
    }  // else a subject was removed between: the next copy does not know it
    if (tries == kTries) throw Unavailable("records and files do not agree; try again when less is removed");
  }
} catch (const fs::filesystem_error& error) {
  ThrowNotWritten("the backup", error.code());
} catch (const SQLite::Exception& error) {
  ThrowFor(error);
}

BackupFigures Restore(const fs::path& backup, const fs::path& data, Lost lost, const Progress& progress) try {
  if (!IsThere(backup / kDatabaseFile)) throw NotFound("this folder is not a backup of a data folder");
  RequireApart(data, backup);
  if (!HoldsNothing(data))  // before all of the backup is read
    throw InputError(
        "the folder to restore into is not empty; give a new one, or remove what a restore that failed left "
        "there");
  RequireMayFill(data);
  const Names lacking = RequireSound(backup, lost, progress.Part(0, 0.5));
  BackupFigures figures;
  MakePrivateFolder(data);
  fs::permissions(data, fs::perms::owner_all);  // it may have been there, empty
  const fs::path records = data / kDatabaseFile, passing = records.string() + kCopying;
  CopyRecords(backup / kDatabaseFile, passing);
  CopyFiles(backup, data, CopiedBefore::kTrusted, figures, progress.Part(0.5, 1));
  if (!std::ranges::includes(lacking, MissingIn(data, NamedBy(passing))))
    throw Unavailable(
        "what is restored from has changed meanwhile; remove the new folder and try again, from a backup "
        "that no service and no other backup works on");
  figures.lost = HoldersOf(lacking, passing);
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
