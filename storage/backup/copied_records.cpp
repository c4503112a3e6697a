// SQLite itself copies them.
#include "storage/backup/copied_records.h"

#include <iterator>
#include <optional>

#include "core/errors.h"
#include "core/text/hex_digest.h"
#include "storage/database/database.h"
#include "storage/database/open_for_reading.h"
#include "storage/database/sqlite.h"
#include "storage/files/data_folder.h"
#include "storage/files/flush_to_disk.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

std::string TextRow(SQLite::Statement& row) { return sqlite::Text(row, 0); }

// Hash of the audit trail's last entry; nothing without one, and of records that cannot be read.
std::optional<std::string> EndOfTrail(const fs::path& records) try {
  const auto db = OpenForReading(records);
  if (!db->tableExists("audit")) return std::nullopt;
  return sqlite::One(*db, "last_audit_hash", TextRow);
} catch (const SQLite::Exception&) {
  return std::nullopt;
}

// Their bytes are in no copy. They name people, too: what is removed is overwritten.
void DropUnfinishedUploads(const fs::path& database) {
  SQLite::Database db(database.string(), SQLite::OPEN_READWRITE, kBusyTimeoutMs);
  if (!db.tableExists("resumable")) return;  // written by a program of before
  db.exec("PRAGMA secure_delete = ON");
  sqlite::Execute(db, "remove_unfinished_resumables");
}

}  // namespace

void RequireOfThisKind(SQLite::Database& db) {
  RequireKnown(db);
  if (db.tableExists("job_request") || !db.tableExists("job"))
    return;  // records of before have requests elsewhere
  throw Conflict(
      "this was written by an older version of kinevox; use that version, or let 'kinevox serve' of this one "
      "open a copy of the folder once");
}

void CopyRecords(const fs::path& from, const fs::path& to) {
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
  if (!FlushToDisk(to)) throw Unavailable("the copy cannot be written; is the disk full?");
}

std::set<std::string> NamedBy(const fs::path& records) {
  const auto db = OpenForReading(records);
  std::set<std::string> named;
  for (const char* statement : {"blobs_in_use", "built_models"}) {
    for (std::string& name : sqlite::All(*db, statement, TextRow)) named.insert(std::move(name));
  }
  return named;
}

std::vector<std::string> HoldersOf(const std::set<std::string>& named, const fs::path& records) {
  const auto db = OpenForReading(records);
  std::set<std::string> holders;
  for (const std::string& name : named) {
    if (!IsHexDigest(name))
      holders.insert(name);
    else
      holders.merge([&] {
        const auto ids = sqlite::All(*db, "holders_of_blob", TextRow, name);
        return std::set(ids.begin(), ids.end());
      }());
  }
  return {holders.begin(), holders.end()};
}

bool IsOfAnother(const fs::path& data, const fs::path& backup) {
  const std::optional<std::string> end = EndOfTrail(backup / kDatabaseFile);
  if (!end) return false;
  const auto db = OpenForReading(data / kDatabaseFile);
  return !db->tableExists("audit") || !sqlite::One(*db, "audit_has_hash", TextRow, *end);
}

}  // namespace kvx
