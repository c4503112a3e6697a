// The order: records and the list of what to remove (committed), bytes, the list's lines.
#include "storage/retention.h"

#include <exception>

#include "core/errors.h"
#include "storage/database/sqlite.h"

namespace kvx {
namespace {

struct Removal {
  std::string kind, name;
};

Removal RemovalRow(SQLite::Statement& row) { return {sqlite::Text(row, 0), sqlite::Text(row, 1)}; }
int64_t CountRow(SQLite::Statement& row) { return sqlite::Integer(row, 0); }

void RemoveFile(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::remove(path, error);
  if (error)
    throw Unavailable("bytes of a removed subject cannot be removed now; it is tried again within the hour");
}

int64_t CountOf(SQLite::Database& db, std::string_view statement, const std::string& subject) {
  return sqlite::One(db, statement, CountRow, subject).value_or(0);
}

}  // namespace

void Retention::DeleteSubject(const std::string& subject, const std::string& who,
                              const std::string& project) {
  db_.Write([&](SQLite::Database& db) {
    if (CountOf(db, "count_subject_jobs", subject) > 0) {
      throw Conflict(
          "a job of this subject waits or runs; cancel it and wait for its end, then delete the subject");
    }
    sqlite::Execute(db, "note_blob_removals", subject);
    sqlite::Execute(db, "note_model_removals", subject);
    sqlite::Execute(db, "note_resumable_removals", subject);
    for (const char* statement :
         {"delete_answers_of_subject", "delete_events_of_subject", "delete_jobs_of_subject"}) {
      sqlite::Execute(db, statement, subject);
    }
    const int models = sqlite::Execute(db, "delete_models_of_subject", subject);
    const int bones = sqlite::Execute(db, "delete_bones_of_subject", subject);
    const int scans = sqlite::Execute(db, "delete_scans_of_subject", subject);
    if (sqlite::Execute(db, "delete_subject", subject) == 0) throw NotFound("there is no such subject");
    audit_.Append({who, project, "subject removed", subject,
                   std::to_string(scans) + " scans, " + std::to_string(bones) + " label maps, " +
                       std::to_string(models) + " models"});
  });
  log_holds_removed_ = true;
  EmptyLog();
}

void Retention::EmptyLog() {
  if (log_holds_removed_.exchange(false) && !db_.EmptyLog()) log_holds_removed_ = true;
}

void Retention::RemoveBytesOf(const std::string& kind, const std::string& name,
                              const RemoveModel& remove_model) {
  if (kind == "model") remove_model(name);
  if (kind == "resumable") RemoveFile(uploads_ / name);
  const auto kept = blobs_.KeepOthersOut();  // nobody takes up the same bytes meanwhile
  db_.Write([&](SQLite::Database& db) {
    if (kind == "blob" && CountOf(db, "count_blob_uses", name) == 0) blobs_.Remove(name);
    sqlite::Execute(db, "forget_removal", kind, name);
  });
}

void Retention::RemoveBytes(const RemoveModel& remove_model) {
  const auto removals =
      db_.Read([](SQLite::Database& db) { return sqlite::All(db, "list_removals", RemovalRow); });
  std::exception_ptr failed;
  for (const Removal& removal : removals) {
    try {
      RemoveBytesOf(removal.kind, removal.name, remove_model);
    } catch (...) {  // it keeps none of the others
      failed = std::current_exception();
    }
  }
  if (!removals.empty()) log_holds_removed_ = true;  // after a crash
  EmptyLog();
  if (failed) std::rethrow_exception(failed);
}

void Retention::DropUnrecorded(const std::string& blob) noexcept try {
  const auto kept = blobs_.KeepOthersOut();
  db_.Write([&](SQLite::Database& db) {
    if (CountOf(db, "count_blob_uses", blob) == 0) blobs_.Remove(blob);
  });
} catch (...) {  // it goes with other bytes that nobody names, within hours
}

}  // namespace kvx
