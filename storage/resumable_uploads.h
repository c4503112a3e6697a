// Uploads that go on after a lost connection (tus 1.0):
// how much of each is surely on disk, and until when it is kept.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/errors.h"
#include "storage/database/database.h"

namespace kvx {

class Gone : public NotFound {
  using NotFound::NotFound;
};  // HTTP 410
class Locked : public Conflict {
  using Conflict::Conflict;
};  // HTTP 423

struct ResumableUpload {
  std::string id, subject;
  std::string kind;                     // "scan" or "bones"
  std::string parameters;               // JSON: the query of the plain upload
  std::optional<std::string> sha256;    // of the whole, as announced
  int64_t length = 0, received = 0;     // bytes
  std::string metadata;                 // as the client sent it
  std::optional<std::string> location;  // of the record it became
  int64_t expires_ms = 0;
};

class ResumableUploads {
 public:
  ResumableUploads(Database& db, std::filesystem::path folder,
                   int64_t lifetime_ms = int64_t(24) * 3600 * 1000);
  ~ResumableUploads();

  ResumableUpload Create(ResumableUpload upload);  // gives it its id and expiry
  ResumableUpload Require(const std::string& id);  // throws NotFound, or Gone: expired, or its bytes are lost
  int CountOpen(const std::string& subject);       // neither finished nor expired
  void Remove(const std::string& id);              // throws Locked while somebody writes
  int RemoveExpired();                             // returns how many

  // One request's bytes, from `received` on. Holds the upload alone; throws Locked when another does.
  class Writer {
   public:
    ~Writer();
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
    const ResumableUpload& upload() const { return upload_; }
    int64_t offset() const { return offset_; }  // what has been written, kept or not
    bool Complete() const { return offset_ == upload_.length; }
    void Write(std::span<const char> bytes);  // throws InputError beyond the length, Unavailable: disk full
    // On disk, and counted. The last byte is not counted before Finish: a file that is whole but recorded
    // nowhere would look finished to its client.
    void Keep();
    std::filesystem::path path() const;        // of the bytes, flushed
    void Finish(const std::string& location);  // within a transaction: it has become a record

   private:
    friend class ResumableUploads;
    Writer(ResumableUploads& owner, ResumableUpload upload);
    ResumableUploads& owner_;
    ResumableUpload upload_;
    int64_t offset_ = 0;
    int file_ = -1;
  };
  std::unique_ptr<Writer> Continue(const std::string& id);

 private:
  struct State;
  void Unlock(const std::string& id);
  std::filesystem::path PathOf(const std::string& id) const { return folder_ / id; }
  Database& db_;
  std::filesystem::path folder_;
  int64_t lifetime_ms_;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
