// Removing a subject for good: its records in one transaction with the audit entry, then the bytes. What
// could not be removed at once (a crash in between) is remembered
// in the database and removed later.
#pragma once
#include <atomic>
#include <functional>
#include <string>

#include "storage/audit.h"
#include "storage/database/database.h"
#include "storage/files/blob_store.h"

namespace kvx {

class Retention {
 public:
  // `uploads` holds the bytes of resumable uploads that are not finished.
  Retention(Database& db, BlobStore& blobs, AuditTrail& audit, std::filesystem::path uploads)
      : db_(db), blobs_(blobs), audit_(audit), uploads_(std::move(uploads)) {}

  // Records of the subject, its scans, bones, models, jobs and kept answers. Throws NotFound; Conflict while
  // a job of it waits or runs. The audit entry says how many scans, label maps and models went.
  void DeleteSubject(const std::string& subject, const std::string& who, const std::string& project);

  // Removed records lie in the database's log until it is emptied. Nothing to do most of the time; where
  // somebody was reading, it is tried again at the next call.
  void EmptyLog();

  // Its files; throws to be asked again later
  using RemoveModel = std::function<void(const std::string& model)>;
  // Of all removed subjects. What cannot be removed stays for the next call, and is thrown when all else
  // went.
  void RemoveBytes(const RemoveModel& remove_model);

  // Bytes that were placed for a record that was refused then; they stay where another record names them.
  void DropUnrecorded(const std::string& blob) noexcept;

 private:
  void RemoveBytesOf(const std::string& kind, const std::string& name, const RemoveModel& remove_model);

  Database& db_;
  BlobStore& blobs_;
  AuditTrail& audit_;
  std::filesystem::path uploads_;
  std::atomic<bool> log_holds_removed_{false};
};

}  // namespace kvx
